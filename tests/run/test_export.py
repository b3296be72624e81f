"""Samples exported for ParaView."""
import subprocess
import sys
from pathlib import Path
from xml.etree import ElementTree

import h5py
import numpy as np
import pytest
from crackle.files import read_run
from program import OUTPUT, break_samples

SCRIPT = Path(__file__).resolve().parents[2] / "postprocess" / "export_xdmf.py"
KINDS = {("Float", 8): np.float64, ("Int", 4): np.int32, ("Char", 1): np.int8}


def export(folder, *arguments):
    return subprocess.run([sys.executable, SCRIPT, *arguments], cwd=folder, capture_output=True, text=True, timeout=60,
                          check=False)


def arrays(folder, grid):
    """Every array that a grid refers to, by its element's name; they must be as the XDMF says."""
    found = {}
    for parent in grid:
        for item in parent.findall("DataItem"):
            file_name, _, name = item.text.partition(":")
            with h5py.File(folder / file_name) as file:
                data = file[name][...]
            assert data.shape == tuple(map(int, item.get("Dimensions").split()))
            assert data.dtype == KINDS[item.get("NumberType"), int(item.get("Precision"))]
            found[parent.get("Name", parent.tag)] = data
    return found


def grids(path):
    return ElementTree.parse(path).getroot().findall("./Domain/Grid/Grid")


def test_steps_show_the_breaks_of_the_sample(tmp_path):
    break_samples(tmp_path, "-lattice_size 7 -samples 3")
    assert export(tmp_path, OUTPUT, "-s", "1", "-n", "6", "-o", "crack.xdmf").returncode == 0
    run = read_run(tmp_path / OUTPUT)
    breaks, peak, network = run.breaks(1), int(run.n_p[1]), run.network()
    steps = grids(tmp_path / "crack.xdmf")
    times = [int(grid.find("Time").get("Value")) for grid in steps]
    assert times == sorted(times) and {0, peak, len(breaks.bond)} <= set(times)
    for time, grid in zip(times, steps):
        data = arrays(tmp_path, grid)
        np.testing.assert_array_equal(np.sort(np.flatnonzero(data["state"])), np.sort(breaks.bond[:time]))
        assert np.count_nonzero(data["state"] == 2) == max(0, time - peak)
        np.testing.assert_array_equal(data["Geometry"][data["Topology"]][..., :2], network.segments())
        np.testing.assert_array_equal(data["break_load"][breaks.bond], breaks.load)
        np.testing.assert_array_equal(np.argsort(data["break_number"])[-len(breaks.bond):], breaks.bond)


@pytest.mark.parametrize("model, column", [("spring", 1), ("fuse", 2)])
def test_snapshots_become_displacements_and_forces(tmp_path, model, column):
    """The top grip is displaced by the plate's displacement, P_k/F_k, the bottom one not at all."""
    break_samples(tmp_path, f"-model {model} -lattice_size 5 -record breaks,snapshot -record_snapshot_at 1,9")
    assert export(tmp_path, OUTPUT).returncode == 0
    run = read_run(tmp_path / OUTPUT)
    steps = grids(tmp_path / OUTPUT.replace(".h5", ".xdmf"))
    assert [grid.find("Time").get("Value") for grid in steps] == ["0", "8"]
    grip = run.network().grip[run.network().bonds.ravel()]
    for grid, number in zip(steps, (1, 9)):
        data, plate = arrays(tmp_path, grid), run.breaks(0).load[number - 1] / run.breaks(0).stiffness[number - 1]
        np.testing.assert_allclose(data["displacement"][grip == 2, column], plate, rtol=1e-10)
        np.testing.assert_allclose(data["displacement"][grip == 1, column], 0, atol=1e-12)
        assert not data["force"][data["state"] > 0].any() and np.abs(data["force"]).max() > 0.01


def test_bad_input_is_told_in_one_line(tmp_path):
    break_samples(tmp_path, "-lattice_size 3 -record none", output="bare.h5")
    for arguments, word in ((("none.h5",), "no such file"), (("bare.h5",), "-record breaks"),
                            (("bare.h5", "-n", "0"), "--steps 0")):
        result = export(tmp_path, *arguments)
        assert result.returncode == 1 and result.stderr.count("\n") == 1 and word in result.stderr
