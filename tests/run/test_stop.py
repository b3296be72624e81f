"""-stop ends a sample where the user has seen enough: its breaks are the first ones of the whole sample."""
import numpy as np
import pytest
from program import break_samples

SCENE = "-lattice_size 8"
BREAKS = ("/breaks/bond", "/breaks/load", "/breaks/stiffness")


def stopped_and_whole(folder, stop, scene=SCENE):
    """Both samples; the stopped one's breaks are a part of the whole one's, bit for bit."""
    stopped = break_samples(folder, f"{scene} -stop {stop}", "stopped.h5")
    whole = break_samples(folder, scene, "whole.h5")
    n = stopped["/samples/n_f"][0]
    for name in BREAKS:
        assert len(stopped[name]) == n
        np.testing.assert_array_equal(stopped[name], whole[name][:n])
    assert stopped["/samples/initial_stiffness"] == whole["/samples/initial_stiffness"]
    if n > 0:
        assert stopped["/samples/peak_load"][0] == whole["/breaks/load"][:n].max()
        assert stopped["/samples/n_p"][0] == np.argmax(whole["/breaks/load"][:n]) + 1
    return stopped, whole


def test_failure_is_the_default(tmp_path):
    stopped, whole = stopped_and_whole(tmp_path, "failure")
    assert len(stopped["/breaks/bond"]) == len(whole["/breaks/bond"])


@pytest.mark.parametrize("model", ["spring", "fuse"])
@pytest.mark.parametrize("count", [0, 1, 7])
def test_after_so_many_breaks(tmp_path, model, count):
    stopped, _ = stopped_and_whole(tmp_path, f"breaks={count}", f"{SCENE} -model {model}")
    assert stopped["/samples/n_f"][0] == count


def test_more_breaks_than_there_are_end_at_failure(tmp_path):
    stopped, whole = stopped_and_whole(tmp_path, "breaks=1000000")
    assert len(stopped["/breaks/bond"]) == len(whole["/breaks/bond"])


@pytest.mark.parametrize("share", [1, 0.9, 0.5, 0.01])
def test_below_a_share_of_the_intact_stiffness(tmp_path, share):
    stopped, whole = stopped_and_whole(tmp_path, f"stiffness={share}")
    n, limit = stopped["/samples/n_f"][0], share * whole["/breaks/stiffness"][0]
    assert (whole["/breaks/stiffness"][:n] >= limit).all()
    assert whole["/breaks/stiffness"][n] < limit
    assert n > 0


def test_stiffness_of_0_ends_at_failure(tmp_path):
    stopped, whole = stopped_and_whole(tmp_path, "stiffness=0")
    assert len(stopped["/breaks/bond"]) == len(whole["/breaks/bond"])


@pytest.mark.parametrize("displacement", [0.3, 1.0, 2.0])
def test_at_a_displacement_of_the_plate(tmp_path, displacement):
    """A plate that only moves up makes all breaks before the first one that needs more."""
    stopped, whole = stopped_and_whole(tmp_path, f"displacement={displacement}")
    needed = whole["/breaks/load"] / whole["/breaks/stiffness"]
    assert stopped["/samples/n_f"][0] == np.argmax(needed > displacement)
    assert needed.max() > displacement


def test_at_no_displacement_nothing_breaks(tmp_path):
    stopped, whole = stopped_and_whole(tmp_path, "displacement=0")
    assert stopped["/samples/n_f"][0] == stopped["/samples/n_p"][0] == 0
    assert stopped["/samples/peak_load"][0] == stopped["/samples/peak_displacement"][0] == 0


def test_beyond_every_displacement_is_failure(tmp_path):
    stopped, whole = stopped_and_whole(tmp_path, "displacement=1e9")
    assert len(stopped["/breaks/bond"]) == len(whole["/breaks/bond"])


def test_every_sample_ends_where_it_does_alone(tmp_path):
    """A stopped sample leaves nothing behind for the next one."""
    scene = f"{SCENE} -stop breaks=5"
    together = break_samples(tmp_path, f"{scene} -samples 3", "together.h5")
    for sample in range(3):
        alone = break_samples(tmp_path, f"{scene} -first_sample {sample} -overwrite")
        for name in BREAKS:
            np.testing.assert_array_equal(together[name][5 * sample:5 * sample + 5], alone[name])
