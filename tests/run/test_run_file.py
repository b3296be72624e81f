"""The run file: the schema, nothing that nobody asked for, the same samples in every way of asking."""
import fcntl
import os
import time

import h5py
import numpy as np
import pytest
from crackle.files import read_run
from networks import FREE
from program import OUTPUT, assert_same, attributes, break_samples, contents, options_of, run, succeed

SAMPLES = {  # name: type; one value a sample
    "/samples/index": "int64", "/samples/peak_load": "float64", "/samples/peak_displacement": "float64",
    "/samples/n_p": "int32", "/samples/n_f": "int32", "/samples/initial_stiffness": "float64",
    "/samples/wall_time": "float64",
}
BREAKS = {"/breaks/bond": "int32", "/breaks/load": "float64", "/breaks/stiffness": "float64"}
NETWORK = {  # name: type, columns
    "/network/nodes/position": ("float64", 2), "/network/nodes/grip": ("int8", 0),
    "/network/bonds/nodes": ("int32", 2), "/network/bonds/stiffness": ("float64", 0),
}
SMALL = "-lattice_size 5 -samples 3"


def assert_samples(found, samples):
    for name, kind in SAMPLES.items():
        assert (found[name].dtype, found[name].shape) == (np.dtype(kind), (samples,)), name


def test_schema_of_samples_and_breaks(tmp_path):
    found = break_samples(tmp_path, SMALL)
    assert found.keys() == {*SAMPLES, *BREAKS, "/samples/break_offset"}
    assert_samples(found, 3)
    offset = found["/samples/break_offset"]
    assert offset.dtype == np.int64 and offset.shape == (4,) and offset[0] == 0
    np.testing.assert_array_equal(np.diff(offset), found["/samples/n_f"])
    for name, kind in BREAKS.items():
        assert (found[name].dtype, found[name].shape) == (np.dtype(kind), (offset[-1],)), name
    np.testing.assert_array_equal(found["/samples/index"], [0, 1, 2])


def test_rows_of_samples_follow_from_their_breaks(tmp_path):
    begun = time.monotonic()
    found = break_samples(tmp_path, SMALL)
    seconds = time.monotonic() - begun
    for s, (begin, end) in enumerate(zip(found["/samples/break_offset"], found["/samples/break_offset"][1:])):
        bond, load, stiffness = (found[name][begin:end] for name in BREAKS)
        peak = int(np.argmax(load))
        assert len(np.unique(bond)) == len(bond) and bond.min() >= 0 and bond.max() < 96
        assert found["/samples/n_p"][s] == peak + 1
        assert found["/samples/peak_load"][s] == load[peak]
        assert found["/samples/peak_displacement"][s] == load[peak] / stiffness[peak]
        # a strategy may take the one from its factor's last pivot, the other from displacements
        assert found["/samples/initial_stiffness"][s] == pytest.approx(stiffness[0], rel=1e-13)
        assert (np.diff(stiffness) < 0).all() and stiffness[-1] > 1e-8 * stiffness[0]
    assert (found["/samples/wall_time"] > 0).all() and found["/samples/wall_time"].sum() < seconds


def test_attributes(tmp_path):
    succeed(tmp_path, SMALL)
    found = attributes(tmp_path / OUTPUT)
    assert found.keys() == {"schema_version", "code_version", "options", "deciding_options", "created", "nodes",
                            "components", "bonds"}
    assert found["schema_version"] == 2 and found["bonds"] == 96
    assert [int(number) >= 0 for number in found["code_version"].split(b".")]
    np.datetime64(found["created"].decode().rstrip("Z"))


def test_links_are_followed_and_permissions_kept(tmp_path):
    """An output that is a link into scratch arrives there, shards and all, also one that isn't there yet."""
    (tmp_path / "scratch").mkdir()
    (tmp_path / OUTPUT).symlink_to("scratch/run.h5")
    for more in ("", " -overwrite", " -samples 3 -resume"):
        succeed(tmp_path, SMALL + more)
        assert (tmp_path / OUTPUT).is_symlink()
        assert sorted(contents(tmp_path)) == [OUTPUT, "scratch", "scratch/run.h5"]
        (tmp_path / "scratch" / "run.h5").chmod(0o640)
    assert (tmp_path / "scratch" / "run.h5").stat().st_mode & 0o777 == 0o640
    assert len(read_run(tmp_path / OUTPUT)) == 3


def test_one_file_and_no_more(tmp_path):
    succeed(tmp_path, SMALL)
    assert list(contents(tmp_path)) == [OUTPUT]
    succeed(tmp_path, SMALL + " -output other.run")
    assert list(contents(tmp_path)) == [OUTPUT, "other.run"]


def test_record_none_keeps_one_row_a_sample(tmp_path):
    kept = break_samples(tmp_path, SMALL + " -record none", "none.h5")
    assert kept.keys() == SAMPLES.keys()
    with h5py.File(tmp_path / "none.h5", "r") as file:
        assert list(file) == ["samples"]
    every = break_samples(tmp_path, SMALL)
    assert_same(kept, {name: every[name] for name in SAMPLES})


@pytest.mark.parametrize("model, components", [("spring", 2), ("fuse", 1)])
def test_record_network(tmp_path, model, components):
    scene = f"-model {model} -lattice_size 5 -lattice_row_spacing 0.5"
    found = break_samples(tmp_path, f"{scene} -record network")
    assert found.keys() == {*SAMPLES, *NETWORK, "/network/bonds/threshold"}
    for name, (kind, columns) in NETWORK.items():
        rows = 36 if "nodes/" in name.replace("bonds/nodes", "") else 96
        assert found[name].dtype == np.dtype(kind), name
        assert found[name].shape == ((rows, columns) if columns else (rows,)), name
    assert found["/network/bonds/threshold"].dtype == np.float64
    group = attributes(tmp_path / OUTPUT, "network")
    assert group["components"] == components and group["period_x"] == 6
    np.testing.assert_array_equal(np.unique(found["/network/nodes/position"][:, 1]), np.arange(6) / 2)
    np.testing.assert_array_equal(np.bincount(found["/network/nodes/grip"]), [24, 6, 6])


def test_network_of_several_samples_has_no_thresholds(tmp_path):
    found = break_samples(tmp_path, SMALL + " -record network")
    assert found.keys() == {*SAMPLES, *NETWORK}


def test_record_profile(tmp_path):
    """Broken bonds by height: every one counts once."""
    found = break_samples(tmp_path, SMALL + " -record profile")
    assert found.keys() == {*SAMPLES, "/profile/peak", "/profile/failure"}
    for name, count in (("/profile/peak", "/samples/n_p"), ("/profile/failure", "/samples/n_f")):
        assert found[name].dtype == np.int32 and found[name].shape[0] == 3
        np.testing.assert_array_equal(found[name].sum(axis=1), found[count])


@pytest.mark.parametrize("model", ["spring", "fuse"])
def test_record_snapshot(tmp_path, model):
    """At the load at which it breaks, the bond's force is its threshold, and no ratio is larger."""
    found = break_samples(tmp_path, f"-model {model} -lattice_size 5 -record breaks,network,snapshot "
                                    "-record_snapshot_at 9,1,4")
    np.testing.assert_array_equal(found["/snapshots/number"], [1, 4, 9])
    np.testing.assert_array_equal(found["/snapshots/sample"], [0, 0, 0])
    nodes, threshold = found["/network/bonds/nodes"], found["/network/bonds/threshold"]
    free = found["/network/nodes/grip"] == FREE
    for row, k in enumerate((0, 3, 8)):
        force, u = found["/snapshots/force"][row], found["/snapshots/displacement"][row]
        np.testing.assert_array_equal(force[found["/breaks/bond"][:k]], 0)
        assert np.argmax(np.abs(force) / threshold) == found["/breaks/bond"][k]
        np.testing.assert_allclose(np.max(np.abs(force) / threshold), 1, rtol=1e-9)
        u = u.reshape(36, -1)
        plate = found["/breaks/load"][k] / found["/breaks/stiffness"][k]
        np.testing.assert_allclose(u[30:, -1], plate, rtol=1e-9)
        np.testing.assert_array_equal(u[:6, -1], 0)
        if model == "fuse":  # currents balance at every free node
            into = np.bincount(nodes[:, 1], force, 36) - np.bincount(nodes[:, 0], force, 36)
            np.testing.assert_allclose(into[free], 0, atol=1e-12)


def test_snapshots_beyond_the_last_break_are_not_there(tmp_path):
    found = break_samples(tmp_path, "-lattice_size 2 -record snapshot -record_snapshot_at 1,1000")
    np.testing.assert_array_equal(found["/snapshots/number"], [1])


def listed_in_help(folder):
    """Options of crackle and their defaults, as -help gives them."""
    own = run(folder, "-help").stdout.split("Every option of PETSc")[0].splitlines()
    rows = [line.split(None, 1) for line in own if line.startswith("  -")]
    return {name: rest[1:rest.index(")")] for name, rest in rows}


def test_options_list_every_value_used(tmp_path):
    """Those that were not given too, but not those of no use in the scene; the same lines are echoed."""
    result = succeed(tmp_path, "-lattice_size 3 -ksp_type cg -ksp_rtol 1e-13 -mat_view ::ascii_info")
    options = options_of(tmp_path / OUTPUT)
    expected = listed_in_help(tmp_path)
    for useless in ("-equilibrium_tree_verify", "-equilibrium_tree_view", "-equilibrium_check_bound", "-lattice_file",
                    "-equilibrium_tree_kernels", "-equilibrium_tree_precision", "-equilibrium_tree_threads",
                    "-stiffness_contrast", "-disorder_exponent", "-record_snapshot_at", "-record_profile_height"):
        expected.pop(useless, None)
    given = {"-lattice_size": "3", "-equilibrium": "ksp", "-ksp_type": "cg", "-ksp_rtol": "1e-13", "-mat_view": "::ascii_info"}
    assert options == {**expected, **given}
    for name, value in options.items():
        assert f"{name} {value}\n" in result.stdout


def test_options_list_those_of_an_options_file(tmp_path):
    (tmp_path / "scene.opts").write_text("# a scene\n-model fuse # fuses\n-lattice_size 3\n-seed 5\n")
    succeed(tmp_path, "-options_file scene.opts -seed 6")
    options = options_of(tmp_path / OUTPUT)
    assert (options["-model"], options["-lattice_size"], options["-seed"]) == ("fuse", "3", "6")


def test_options_list_the_model_of_a_network_file(tmp_path):
    """Also when the file decides it: whoever reads the run file wants to know."""
    break_samples(tmp_path, "-model fuse -lattice_size 3 -record network", "network.h5")
    break_samples(tmp_path, "-lattice file -lattice_file network.h5 -disorder file")
    assert options_of(tmp_path / OUTPUT)["-model"] == "fuse"


def test_options_of_the_file_given_again_make_the_same_file(tmp_path):
    first = break_samples(tmp_path, "-lattice_size 4 -samples 2 -seed 9 -grips clamped -break_on tension")
    lines = attributes(tmp_path / OUTPUT)["options"].decode().splitlines()
    (tmp_path / "again.opts").write_text("\n".join(line for line in lines if "-output" not in line) + "\n")
    assert_same(break_samples(tmp_path, "-options_file again.opts", "again.h5"), first)


@pytest.mark.parametrize("more", ["", "-model fuse", "-grips clamped -break_on tension", "-ksp_type cg"])
def test_the_same_options_give_the_same_datasets(tmp_path, more):
    line = f"{SMALL} {more} -record breaks,profile,network"
    assert_same(break_samples(tmp_path, line, "b.h5"), break_samples(tmp_path, line, "a.h5"))


@pytest.mark.parametrize("model", ["spring", "fuse"])
def test_a_sample_does_not_depend_on_those_before_it(tmp_path, model):
    scene = f"-model {model} -lattice_size 9 -record breaks,profile"
    whole = break_samples(tmp_path, f"{scene} -samples 6", "whole.h5")
    begin = 0
    for samples in (1, 3, 2):
        part = break_samples(tmp_path, f"{scene} -samples {samples} -first_sample {begin} -overwrite")
        assert_same(part, cut(whole, begin, begin + samples))
        begin += samples


def cut(whole, begin, end):
    """Samples begin to end of a run's datasets."""
    offset = whole["/samples/break_offset"]
    part = {name: values[begin:end] for name, values in whole.items()}
    part["/samples/break_offset"] = offset[begin:end + 1] - offset[begin]
    for name in BREAKS:
        part[name] = whole[name][offset[begin]:offset[end]]
    return part


@pytest.mark.parametrize("version", [1, 2])
def test_python_reads_both_schemas(tmp_path, version):
    """Those with checksums and those from before."""
    expected = break_samples(tmp_path, SMALL)
    with h5py.File(tmp_path / OUTPUT, "r+") as file:
        file.attrs["schema_version"] = np.int32(version)
    found = read_run(tmp_path / OUTPUT)
    np.testing.assert_array_equal(found.peak_load, expected["/samples/peak_load"])


@pytest.mark.parametrize("text", [str, np.bytes_, lambda text: np.array([text], h5py.string_dtype()),
                                  lambda text: np.array([text.encode()])])
def test_python_reads_texts_of_every_kind(tmp_path, text):
    """Of fixed and variable length, alone and as an array."""
    succeed(tmp_path, SMALL + " -monitor none")
    with h5py.File(tmp_path / OUTPUT, "r+") as file:
        options = file.attrs["options"].decode()
        del file.attrs["options"]
        file.attrs["options"] = text(options)
    assert read_run(tmp_path / OUTPUT).options["-lattice_size"] == "5"


def replace_by_text(path):
    path.write_text("of no worth\n")


def cut_in_half(path):
    path.write_bytes(path.read_bytes()[:path.stat().st_size // 2])


def spoil_data(path):
    """One bit of what a checksum is kept for."""
    with h5py.File(path, "r+") as file:
        load = file["breaks/load"][...]
        del file["breaks/load"]
        kept = file.create_dataset("breaks/load", data=load, fletcher32=True, chunks=load.shape)
        place = kept.id.get_chunk_info(0).byte_offset
    data = bytearray(path.read_bytes())
    data[place + 9] ^= 1
    path.write_bytes(data)


def leave_unwritten(path):
    with h5py.File(path, "r+") as file:
        shape = file["breaks/load"].shape
        del file["breaks/load"]
        file.create_dataset("breaks/load", shape, float)


@pytest.mark.parametrize("harm, reason", [(replace_by_text, "file signature not found"), (cut_in_half, "truncated file"),
                                          (spoil_data, "/breaks/load: .*checksum"),
                                          (leave_unwritten, "/breaks/load: .*never written")])
def test_python_keeps_the_reason(tmp_path, harm, reason):
    succeed(tmp_path, SMALL + " -monitor none")
    harm(tmp_path / OUTPUT)
    with pytest.raises(ValueError, match=f"{OUTPUT}.*{reason}") as error:
        read_run(tmp_path / OUTPUT)
    assert "\n" not in str(error.value)


def test_python_tells_of_a_file_that_is_locked(tmp_path):
    succeed(tmp_path, SMALL + " -monitor none")
    with open(tmp_path / OUTPUT, "rb") as held:
        fcntl.flock(held, fcntl.LOCK_EX)
        with pytest.raises(ValueError, match="unable to lock file"):
            read_run(tmp_path / OUTPUT)


def test_python_refuses_a_shard_that_is_no_file(tmp_path):
    """It doesn't pass it over in silence, nor wait for a pipe's answer."""
    succeed(tmp_path, SMALL + " -monitor none")
    shard = tmp_path / (OUTPUT + ".shards") / "0.h5"
    shard.parent.mkdir()
    for make in (os.mkfifo, os.mkdir, lambda path: path.symlink_to("nowhere")):
        make(shard)
        with pytest.raises(ValueError, match="0.h5: no plain file"):
            read_run(tmp_path / OUTPUT)
        shard.rmdir() if shard.is_dir() else shard.unlink()
