"""postprocess reads what the program wrote."""
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from crackle.files.run_file import read_run, triangular_network
from networks import irregular_network
from program import OUTPUT, break_samples, succeed

SCRIPTS = Path(__file__).resolve().parents[2] / "postprocess"
FIELDS = ("index", "peak_load", "peak_displacement", "n_p", "n_f", "initial_stiffness", "wall_time")


def draw(folder, *arguments):
    environment = {**os.environ, "MPLCONFIGDIR": str(folder / "matplotlib"), "PYTHONDONTWRITEBYTECODE": "1"}
    return subprocess.run([sys.executable, SCRIPTS / "sample.py", *arguments], cwd=folder, env=environment,
                          capture_output=True, text=True, timeout=60, check=False)


def test_read_run_gives_what_the_file_holds(tmp_path):
    written = break_samples(tmp_path, "-lattice_size 5 -samples 4 -first_sample 2 -grips clamped")
    read = read_run(tmp_path / OUTPUT)
    assert len(read) == 4 and read.find(3) == 1
    for name in FIELDS:
        np.testing.assert_array_equal(getattr(read, name), written[f"/samples/{name}"])
    offset = written["/samples/break_offset"]
    for s, (begin, end) in enumerate(zip(offset, offset[1:])):
        for name in ("bond", "load", "stiffness"):
            expected = written[f"/breaks/{name}"][begin:end]
            np.testing.assert_array_equal(getattr(read.breaks(s), name), expected)
    assert read.options["-lattice_size"] == "5" and read.options["-grips"] == "clamped"


@pytest.mark.parametrize("size", [1, 2, 7])
@pytest.mark.parametrize("model, components", [("spring", 2), ("fuse", 1)])
def test_network_rebuilt_from_the_options_is_the_recorded_one(tmp_path, model, components, size):
    scene = f"-model {model} -lattice_size {size} -lattice_row_spacing 0.7"
    break_samples(tmp_path, f"{scene} -record network")
    recorded, rebuilt = read_run(tmp_path / OUTPUT).network(), triangular_network(size, 0.7, components)
    for name in ("positions", "grip", "bonds", "stiffness"):
        np.testing.assert_array_equal(getattr(rebuilt, name), getattr(recorded, name))
    np.testing.assert_array_equal(rebuilt.segments(), recorded.segments())
    assert (rebuilt.components, rebuilt.period_x) == (recorded.components, recorded.period_x)
    assert recorded.threshold is not None


def test_what_was_not_recorded_is_told(tmp_path):
    break_samples(tmp_path, "-lattice_size 3 -record none")
    with pytest.raises(ValueError, match="run with -record breaks"):
        read_run(tmp_path / OUTPUT).breaks(0)


def test_run_that_has_finished_no_sample_yet(tmp_path):
    """As it is from the first moment on: no samples, and the folder of those to come."""
    break_samples(tmp_path, "-lattice_size 3 -stop breaks=1")
    os.mkdir(tmp_path / (OUTPUT + ".shards"))
    assert len(read_run(tmp_path / OUTPUT)) == 1


@pytest.mark.parametrize("scene", ["-lattice_size 8", "-lattice_size 8 -model fuse",
                                   "-lattice_size 8 -stop breaks=9", "-lattice_size 1"])
def test_sample_is_drawn(tmp_path, scene):
    succeed(tmp_path, f"{scene} -monitor none")
    result = draw(tmp_path, OUTPUT, "-o", "picture.png")
    assert result.returncode == 0, result.stderr
    assert (tmp_path / "picture.png").read_bytes().startswith(b"\x89PNG")
    assert (tmp_path / "picture.png").stat().st_size > 10000


def test_sample_of_a_network_from_a_file_is_drawn_with_its_own_units(tmp_path):
    """A fuse network carries a current, also when only the network file says what it is."""
    irregular_network(1, components=1).write(tmp_path / "network.h5")
    succeed(tmp_path, "-lattice file -lattice_file network.h5 -disorder file -record breaks,network")
    result = draw(tmp_path, OUTPUT, "-o", "picture.svg")
    assert result.returncode == 0, result.stderr
    assert "fuse, file" in (tmp_path / "picture.svg").read_text()


def test_sample_that_is_not_there_is_told_in_one_line(tmp_path):
    succeed(tmp_path, "-lattice_size 3 -monitor none")
    for arguments, word in (((OUTPUT, "-s", "7"), "no sample 7"), (("none.h5",), "no such file")):
        result = draw(tmp_path, *arguments)
        assert result.returncode == 1 and result.stderr.count("\n") == 1 and word in result.stderr
