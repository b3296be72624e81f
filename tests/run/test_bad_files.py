"""A bad network file or output ends in one line that tells how to mend it, and touches no file."""
import os

import h5py
import numpy as np
import pytest
from networks import BOTTOM, FREE, TOP, NetworkOfFile, small_network
from program import OUTPUT, contents, refuse, run, succeed, whole_run

FILE = "-lattice file -lattice_file network.h5"
FROM_FILE = FILE + " -disorder file"
GOOD = small_network()

# What is refused: the network, words of the message.
BAD = {
    "node_too_large": (GOOD.but(nodes={4: [1, 6]}), ["node 6", "bond 4", "0 to 5"]),
    "node_far_too_large": (GOOD.but(nodes={4: [1, 2**31 - 1]}), ["bond 4", "0 to 5"]),
    "node_negative": (GOOD.but(nodes={4: [-1, 3]}), ["node -1", "bond 4", "0 to 5"]),
    "self_bond": (GOOD.but(nodes={5: [3, 3]}), ["bond 5", "different nodes"]),
    "zero_length": (GOOD.but(position={3: GOOD.position[2]}), ["bond 5", "length"]),
    "zero_length_over_the_period": (GOOD.but(position={1: [2, 0]}, period_x=2.0), ["bond 0", "length"]),
    "stiffness_nan": (GOOD.but(stiffness={2: np.nan}), ["stiffness", "bond 2", "nan", "from 0"]),
    "stiffness_negative": (GOOD.but(stiffness={2: -1.0}), ["stiffness", "bond 2", "-1", "from 0"]),
    "stiffness_infinite": (GOOD.but(stiffness={2: np.inf}), ["stiffness", "bond 2", "inf"]),
    "threshold_nan": (GOOD.but(threshold={3: np.nan}), ["threshold", "bond 3", "nan", "from 0"]),
    "threshold_negative": (GOOD.but(threshold={3: -0.5}), ["threshold", "bond 3", "-0.5", "from 0"]),
    "no_grip_nodes": (GOOD.but(grip=np.zeros(6, np.int8)), ["grip", "at least one node"]),
    "no_bottom": (GOOD.but(grip={0: FREE, 1: FREE}), ["grip", "bottom"]),
    "no_top": (GOOD.but(grip={4: FREE, 5: FREE}), ["grip", "top"]),
    "grip_unknown": (GOOD.but(grip={2: 3}), ["grip", "node 2", "3", "0 (free)"]),
    "grip_negative": (GOOD.but(grip={2: -1}), ["grip", "node 2", "-1"]),
    "no_path": (GOOD.without([6, 7, 8, 9]), ["path", "grips"]),
    "no_path_with_stiffness": (GOOD.but(stiffness={6: 0, 7: 0, 8: 0, 9: 0}), ["path", "grips"]),
    "position_nan": (GOOD.but(position={2: [np.nan, 1]}), ["position", "node 2"]),
    "position_infinite": (GOOD.but(position={2: [0, np.inf]}), ["position", "node 2"]),
    "period_negative": (GOOD.but(period_x=-1.0), ["period_x"]),
    "period_nan": (GOOD.but(period_x=np.nan), ["period_x"]),
    "components": (GOOD.but(components=3), ["components", "1 (fuse) or 2 (spring)"]),
    "too_few_grips": (GOOD.but(grip=GOOD.grip[:5]), ["grip", "5", "6"]),
    "too_few_stiffnesses": (GOOD.but(stiffness=GOOD.stiffness[:5]), ["stiffness", "5", "11"]),
    "too_many_thresholds": (GOOD.but(threshold=np.ones(12)), ["threshold", "12", "11"]),
    "no_thresholds": (GOOD.but(threshold=None), ["-disorder", "threshold"]),
    "no_positions": (GOOD.but(position=None), ["position"]),
    "no_bonds": (GOOD.but(nodes=None), ["bonds"]),
    "positions_flat": (GOOD.but(position=np.arange(12.0)), ["position", "shape"]),
    "positions_in_space": (GOOD.but(position=np.zeros((6, 3))), ["position", "shape"]),
    "nodes_flat": (GOOD.but(nodes=GOOD.nodes.ravel()), ["bonds/nodes", "shape"]),
    "bonds_empty": (GOOD.without(range(11)), ["path"]),
}


@pytest.mark.parametrize("name", BAD)
def test_network_that_is_refused(tmp_path, name):
    network, words = BAD[name]
    network.write(tmp_path / "network.h5")
    refuse(tmp_path, FROM_FILE, "network.h5", *words)


def test_node_number_that_an_int32_cannot_hold(tmp_path):
    nodes = GOOD.nodes.astype(np.int64)
    nodes[4, 1] += 2**32  # the same in its lower 32 bits
    GOOD.but(nodes=nodes).write(tmp_path / "network.h5")
    refuse(tmp_path, FROM_FILE, "network.h5", "bond")


def test_file_of_another_kind(tmp_path):
    with h5py.File(tmp_path / "network.h5", "w") as file:
        file["numbers"] = np.arange(3)
    refuse(tmp_path, FROM_FILE, "network.h5", "/network")


@pytest.mark.parametrize("group", ["components", "period_x"])
def test_attribute_that_is_missing_or_a_text(tmp_path, group):
    path = GOOD.write(tmp_path / "network.h5")
    with h5py.File(path, "a") as file:
        del file["network"].attrs[group]
    refuse(tmp_path, FROM_FILE, "network.h5", group)
    with h5py.File(path, "a") as file:
        file["network"].attrs[group] = "two"
    refuse(tmp_path, FROM_FILE, "network.h5", group)


def test_network_that_is_a_dataset_or_has_texts(tmp_path):
    with h5py.File(tmp_path / "network.h5", "w") as file:
        file["network"] = np.arange(3)
    refuse(tmp_path, FROM_FILE, "network.h5")
    path = GOOD.but(stiffness=None).write(tmp_path / "network.h5")
    with h5py.File(path, "a") as file:
        file["network/bonds/stiffness"] = np.array([b"stiff"] * 11)
    refuse(tmp_path, FROM_FILE, "network.h5", "stiffness")


def test_network_file_that_is_missing(tmp_path):
    refuse(tmp_path, FROM_FILE, "network.h5", "exists")


def test_network_file_that_is_a_folder(tmp_path):
    (tmp_path / "network.h5").mkdir()
    refuse(tmp_path, FROM_FILE, "network.h5", "HDF5")


@pytest.mark.parametrize("share", [0, 0.1, 0.5, 0.9])
def test_network_file_that_is_truncated(tmp_path, share):
    path = GOOD.write(tmp_path / "network.h5")
    whole = path.read_bytes()
    path.write_bytes(whole[:int(share * len(whole))])
    refuse(tmp_path, FROM_FILE, "network.h5", "HDF5")


def test_network_file_that_is_not_hdf5(tmp_path):
    (tmp_path / "network.h5").write_text("0 1\n1 2\n")
    refuse(tmp_path, FROM_FILE, "network.h5", "HDF5")


def test_model_other_than_the_network_files(tmp_path):
    GOOD.write(tmp_path / "network.h5")
    refuse(tmp_path, FROM_FILE + " -model fuse", "-model fuse", "network.h5", "spring")


@pytest.mark.parametrize("option", ["-lattice_size 4", "-lattice_row_spacing 1", "-seed 2"])
def test_option_of_the_generated_lattice_beside_a_file(tmp_path, option):
    GOOD.write(tmp_path / "network.h5")
    refuse(tmp_path, f"{FROM_FILE} {option}", option)


def test_thresholds_of_the_file_make_one_sample(tmp_path):
    GOOD.write(tmp_path / "network.h5")
    refuse(tmp_path, FROM_FILE + " -samples 2", "-samples 2", "1 with -disorder file")


def test_path_that_is_no_rigid_one(tmp_path):
    """A chain that only a mechanism joins to the top: nothing carries load. One line, no false result."""
    zigzag = NetworkOfFile(np.array([[0, 0], [1.0, 0], [1.0, 2.0]]), np.array([BOTTOM, FREE, TOP], np.int8),
                           np.array([[0, 1], [1, 2]], np.int32), np.ones(2), np.ones(2))
    zigzag.write(tmp_path / "network.h5")
    result = run(tmp_path, FROM_FILE + " -monitor none")
    assert result.returncode == 1
    assert result.stderr.count("\n") == 1 and result.stderr.startswith("crackle: "), result.stderr
    assert "load" in result.stderr


@pytest.mark.parametrize("output", ["missing/run.h5", "/proc/run.h5", "/sys/run.h5", "scene.txt/run.h5"])
def test_output_where_nothing_can_be_written(tmp_path, output):
    (tmp_path / "scene.txt").write_text("no folder\n")
    refuse(tmp_path, f"-lattice_size 2 -output {output}", "output", output, output=None)


@pytest.mark.parametrize("more", ["", "-overwrite", "-resume"])
def test_output_that_is_a_folder(tmp_path, more):
    (tmp_path / "run.h5").mkdir()
    refuse(tmp_path, f"-lattice_size 2 -output run.h5 {more}", "-output run.h5", output=None)


@pytest.mark.parametrize("more", ["", "-overwrite", "-resume"])
def test_output_that_is_a_pipe(tmp_path, more):
    """Nor may a device, as /dev/null, be replaced by a file."""
    os.mkfifo(tmp_path / "run.h5")
    refuse(tmp_path, f"-lattice_size 2 -output run.h5 {more}", "-output run.h5", output=None)


def test_output_that_exists(tmp_path):
    (tmp_path / OUTPUT).write_bytes(whole_run())
    refuse(tmp_path, "-lattice_size 2", "-output", OUTPUT, "-resume", "-overwrite", output=None)


def test_output_whose_unfinished_samples_exist(tmp_path):
    (tmp_path / (OUTPUT + ".shards")).mkdir()
    (tmp_path / (OUTPUT + ".shards") / "0.h5").write_bytes(whole_run())
    refuse(tmp_path, "-lattice_size 1", "-output", OUTPUT, "-resume", "-overwrite", output=None)


def test_overwrite_replaces_the_output(tmp_path):
    (tmp_path / OUTPUT).write_text("of no worth\n")
    succeed(tmp_path, "-lattice_size 2 -overwrite")
    assert list(contents(tmp_path)) == [OUTPUT]
    with h5py.File(tmp_path / OUTPUT, "r") as file:
        assert len(file["samples/index"]) == 1


@pytest.mark.parametrize("damage", ["truncated", "text", "other"])
def test_resume_of_what_is_no_run_file(tmp_path, damage):
    if damage == "truncated":
        (tmp_path / OUTPUT).write_bytes(whole_run()[:1000])
    elif damage == "text":
        (tmp_path / OUTPUT).write_text("of no worth\n")
    else:
        GOOD.write(tmp_path / OUTPUT)
    refuse(tmp_path, "-lattice_size 1 -resume", OUTPUT, output=None)
