"""crackle_merge: runs with other samples of one scene become the run that has them all."""
import os
import signal
import subprocess
from pathlib import Path

import h5py
import numpy as np
import pytest
from program import (CRACKLE, LONGEST, OUTPUT, assert_same, break_samples, contents, datasets, options_of,
                     pause_until_samples_are_due, run, start, succeed, kill, wait_for)

SCENE = "-lattice_size 8 -record breaks,profile,snapshot,network -record_snapshot_at 1,4"


def merge(folder, *words):
    program = Path(CRACKLE).with_name("crackle_merge")
    return subprocess.run([program, *words], cwd=folder, env=os.environ, text=True, capture_output=True,
                          timeout=LONGEST, check=False)


def parts(folder, *ranges, more=""):
    for i, (first, samples) in enumerate(ranges):
        break_samples(folder, f"{SCENE} -first_sample {first} -samples {samples} {more}", f"{i}.h5")


def refused(folder, *words, names):
    before = contents(folder)
    result = merge(folder, *words)
    assert contents(folder) == before
    assert result.returncode == 1 and result.stderr.count("\n") == 1
    assert all(name in result.stderr for name in names), result.stderr


@pytest.mark.parametrize("order", ["012", "201"])
def test_three_parts_make_the_whole(tmp_path, order):
    parts(tmp_path, (0, 4), (4, 3), (7, 5))
    result = merge(tmp_path, *[f"{i}.h5" for i in order], "-output", "all.h5")
    assert result.returncode == 0 and "12 samples" in result.stdout, result.stderr
    assert_same(datasets(tmp_path / "all.h5"), break_samples(tmp_path, f"{SCENE} -samples 12", "whole.h5"))
    ours, theirs = options_of(tmp_path / "all.h5"), options_of(tmp_path / "whole.h5")
    assert {**ours, "-output": ""} == {**theirs, "-output": ""} and ours["-output"] == "all.h5"


def test_merged_run_goes_on(tmp_path):
    parts(tmp_path, (0, 2), (4, 2))
    merge(tmp_path, "0.h5", "1.h5", "-output", "all.h5")
    found = break_samples(tmp_path, f"{SCENE} -samples 6 -resume", "all.h5")
    assert_same(found, break_samples(tmp_path, f"{SCENE} -samples 6", "whole.h5"))


def test_samples_that_both_have_must_be_the_same(tmp_path):
    parts(tmp_path, (0, 4), (2, 4))
    assert merge(tmp_path, "0.h5", "1.h5", "-output", "all.h5").returncode == 0
    assert_same(datasets(tmp_path / "all.h5"), break_samples(tmp_path, f"{SCENE} -samples 6", "whole.h5"))
    last_of_sample = datasets(tmp_path / "1.h5")["/samples/break_offset"][1] - 1  # long after the peak load
    for name, at in (("breaks/load", last_of_sample), ("breaks/stiffness", last_of_sample),
                     ("samples/initial_stiffness", 0), ("snapshots/displacement", 0)):
        with h5py.File(tmp_path / "1.h5", "r+") as file:
            flat = file[name][...]
            kept = flat.copy()
            flat.ravel()[at] = np.nextafter(flat.ravel()[at], 0) + (0.5 if flat.ravel()[at] == 0 else 0)
            file[name][...] = flat
        refused(tmp_path, "0.h5", "1.h5", "-output", "new.h5", names=["sample 2", "1.h5", "0.h5"])
        with h5py.File(tmp_path / "1.h5", "r+") as file:
            file[name][...] = kept
    assert merge(tmp_path, "0.h5", "1.h5", "-output", "new.h5").returncode == 0


@pytest.mark.parametrize("more, named", [("-seed 2", "-seed 2"), ("-model fuse", "-model"),
                                         ("-equilibrium ksp", "-equilibrium"),
                                         ("-stop breaks=4", "-stop breaks=4")])
def test_other_scenes_are_refused(tmp_path, more, named):
    parts(tmp_path, (0, 1))
    break_samples(tmp_path, f"{SCENE} -first_sample 1 {more}", "other.h5")
    refused(tmp_path, "0.h5", "other.h5", "-output", "all.h5", names=["other.h5", "0.h5", named])


def test_bad_words(tmp_path):
    parts(tmp_path, (0, 1))
    (tmp_path / "text.h5").write_text("a thesis")
    refused(tmp_path, "0.h5", "text.h5", "-output", "all.h5", names=["text.h5", "HDF5"])
    refused(tmp_path, "0.h5", "none.h5", "-output", "all.h5", names=["none.h5", "exists"])
    refused(tmp_path, "0.h5", "-output", "0.h5", names=["-output", "0.h5", "-overwrite"])
    refused(tmp_path, "0.h5", "-output", "no/all.h5", names=["no/all.h5"])
    refused(tmp_path, "0.h5", names=["-output"])
    refused(tmp_path, "-output", "all.h5", names=["run file"])
    refused(tmp_path, "0.h5", "-outptu", "all.h5", names=["-outptu"])
    assert "-output" in merge(tmp_path, "-help").stdout


def test_run_that_was_killed_counts_with_what_it_has(tmp_path):
    process = start(tmp_path, "-lattice_size 32 -samples 500 -monitor none")
    shard = tmp_path / (OUTPUT + ".shards") / "0.h5"
    pause_until_samples_are_due(process)
    while not shard.exists():
        assert process.poll() is None
    kill(process)
    saved = datasets(shard)
    assert merge(tmp_path, OUTPUT, "-output", "all.h5").returncode == 0
    assert_same(datasets(tmp_path / "all.h5"), saved)


def test_output_of_a_run_that_goes_on_is_its_own(tmp_path):
    """Not even -overwrite takes it away: its next shards would join another scene's samples."""
    parts(tmp_path, (0, 2))
    line = "-lattice_size 32 -samples 40 -monitor none -checkpoint_breaks 100 -checkpoint_every 0 -output all.h5"
    process = start(tmp_path, line)
    wait_for((tmp_path / "all.h5.shards" / "0.checkpoint").exists, process)
    process.send_signal(signal.SIGSTOP)
    refused(tmp_path, "0.h5", "-output", "all.h5", "-overwrite", names=["-output all.h5", "no other run"])
    process.send_signal(signal.SIGCONT)
    process.communicate(timeout=LONGEST)
    assert process.returncode == 0
    assert len(datasets(tmp_path / "all.h5")["/samples/index"]) == 40


def test_shards_of_another_scene_join_no_run(tmp_path):
    parts(tmp_path, (0, 2))
    (tmp_path / "0.h5.shards").mkdir()
    break_samples(tmp_path, f"{SCENE} -first_sample 7 -seed 2", "other.h5")
    (tmp_path / "other.h5").rename(tmp_path / "0.h5.shards" / "0.h5")
    refused(tmp_path, "0.h5", "-output", "all.h5", names=["0.h5.shards/0.h5", "-seed 2"])
    result = run(tmp_path, f"{SCENE} -samples 4 -resume -output 0.h5")
    assert result.returncode == 1 and "-seed" in result.stderr, result.stderr


def test_sample_numbers_up_to_the_largest(tmp_path):
    last = 2**63 - 2 - 10**9
    for i, samples in enumerate(("-first_sample 0", f"-first_sample {last} -samples 2")):
        break_samples(tmp_path, f"-lattice_size 4 {samples}", f"{i}.h5")
    assert merge(tmp_path, "0.h5", "1.h5", "-output", "all.h5").returncode == 0
    assert datasets(tmp_path / "all.h5")["/samples/index"].tolist() == [0, last, last + 1]
    assert options_of(tmp_path / "all.h5")["-samples"] == str(last + 2)
    for number in (2**63 - 1, -1):
        with h5py.File(tmp_path / "1.h5", "r+") as file:
            file["samples/index"][1] = number
        refused(tmp_path, "0.h5", "1.h5", "-output", "new.h5", names=["1.h5", str(number), "ascending"])


def test_overwrite_replaces(tmp_path):
    parts(tmp_path, (0, 2), (2, 2))
    succeed(tmp_path, "-lattice_size 3 -output all.h5")
    assert merge(tmp_path, "0.h5", "1.h5", "-output", "all.h5", "-overwrite").returncode == 0
    assert len(datasets(tmp_path / "all.h5")["/samples/index"]) == 4
