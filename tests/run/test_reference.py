"""Bond by bond as the independent model in numpy breaks the same lattice: bonds, loads, stiffnesses."""
import numpy as np
import pytest
from program import OUTPUT, assert_same_while_told, break_samples
from reference_model import break_lattice

GRIPS = ["sliding", "clamped"]
MODELS = ["spring", "fuse"]


def assert_as_reference(folder, size, sample=0, seed=1, model="spring", grips="sliding", break_on="magnitude",
                        row_spacing=1, more=""):
    """One sample of crackle against the reference, with the thresholds that crackle drew."""
    found = break_samples(folder, f"-model {model} -lattice_size {size} -lattice_row_spacing {row_spacing} "
                                  f"-grips {grips} -break_on {break_on} -seed {seed} -first_sample {sample} "
                                  f"-record breaks,network {more}")
    threshold = found["/network/bonds/threshold"]
    assert len(threshold) == (3 * size + 1) * (size + 1)
    assert threshold.min() >= 0 and threshold.max() < 1
    bonds, loads, stiffnesses = break_lattice(size, threshold, model, grips, break_on, row_spacing)
    expected = {"/breaks/bond": bonds, "/breaks/load": loads, "/breaks/stiffness": stiffnesses}
    assert_same_while_told(found, expected)
    assert_summary(found, loads, stiffnesses)


def assert_summary(found, loads, stiffnesses):
    """The row of the one sample, from its breaks."""
    peak = int(np.argmax(loads))
    assert found["/samples/n_f"][0] == len(loads)
    assert found["/samples/n_p"][0] == peak + 1
    np.testing.assert_allclose(found["/samples/peak_load"][0], loads[peak], rtol=1e-9)
    displacement = loads[peak] / stiffnesses[peak]
    np.testing.assert_allclose(found["/samples/peak_displacement"][0], displacement, rtol=1e-9)
    np.testing.assert_allclose(found["/samples/initial_stiffness"][0], stiffnesses[0], rtol=1e-9)
    np.testing.assert_array_equal(found["/samples/break_offset"], [0, len(loads)])


@pytest.mark.parametrize("size", [1, 2, 3])
@pytest.mark.parametrize("grips", GRIPS)
@pytest.mark.parametrize("model", MODELS)
def test_smallest_lattices(tmp_path, model, grips, size):
    for sample in range(3):
        assert_as_reference(tmp_path, size, sample=sample, model=model, grips=grips, more="-overwrite")


@pytest.mark.parametrize("size", [1, 2, 3])
@pytest.mark.parametrize("model", MODELS)
def test_smallest_lattices_in_tension(tmp_path, model, size):
    assert_as_reference(tmp_path, size, model=model, break_on="tension")


@pytest.mark.parametrize("size", range(4, 11))
@pytest.mark.parametrize("break_on", ["magnitude", "tension"])
@pytest.mark.parametrize("grips", GRIPS)
@pytest.mark.parametrize("model", MODELS)
def test_breaks_in_the_order_of_the_reference(tmp_path, model, grips, break_on, size):
    assert_as_reference(tmp_path, size, sample=size % 3, model=model, grips=grips, break_on=break_on)


@pytest.mark.parametrize("sample", [0, 1, 2, 1000000007, 2**62])
@pytest.mark.parametrize("model", MODELS)
def test_samples_of_any_number(tmp_path, model, sample):
    assert_as_reference(tmp_path, 6, sample=sample, seed=2**64 - 1, model=model)


@pytest.mark.parametrize("row_spacing", [np.sqrt(3) / 2, 0.1, 3.0])
@pytest.mark.parametrize("grips", GRIPS)
def test_other_row_spacings(tmp_path, grips, row_spacing):
    assert_as_reference(tmp_path, 5, grips=grips, row_spacing=row_spacing)


@pytest.mark.parametrize("solver", [
    "-equilibrium dense",
    "-equilibrium ksp",
    "-ksp_type preonly -pc_type cholesky -pc_factor_mat_solver_type cholmod",
    "-ksp_type preonly -pc_type cholesky -pc_factor_mat_solver_type mumps",
    "-ksp_type cg -pc_type updown -pc_updown_rank 4",
    "-ksp_type cg -pc_type jacobi",
])
@pytest.mark.parametrize("model", MODELS)
def test_every_solver_breaks_as_the_reference(tmp_path, model, solver):
    assert_as_reference(tmp_path, 6, sample=2, model=model, more=solver)


def test_seeds_and_samples_differ(tmp_path):
    def thresholds(seed, sample):
        line = f"-lattice_size 4 -seed {seed} -first_sample {sample} -record network -overwrite"
        return break_samples(tmp_path, line, OUTPUT)["/network/bonds/threshold"]

    drawn = [thresholds(seed, sample) for seed, sample in ((1, 0), (1, 1), (2, 0), (2, 1), (0, 1))]
    assert len(np.unique(np.concatenate(drawn))) == 5 * 65
