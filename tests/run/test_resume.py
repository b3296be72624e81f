"""A run that was cut short and continued leaves what an uninterrupted one does, bit for bit."""
import time
from pathlib import Path

import pytest
from crackle.files import read_run
from networks import small_network
from program import (OUTPUT, assert_same, attributes, break_samples, contents, datasets, execute,
                     pause_until_samples_are_due, refuse, run, start, succeed)

SCENE = "-lattice_size 6 -record breaks,profile"
SHARDS = OUTPUT + ".shards"
PROJECT = Path(__file__).resolve().parents[2]


@pytest.mark.parametrize("first, then", [
    ("-samples 2", "-samples 7"),
    ("-samples 3 -first_sample 4", "-samples 7"),
    ("-samples 1 -first_sample 3", "-samples 7 -first_sample 0"),
])
def test_more_samples(tmp_path, first, then):
    whole = break_samples(tmp_path, f"{SCENE} -samples 7", "whole.h5")
    begun = break_samples(tmp_path, f"{SCENE} {first}")
    continued = break_samples(tmp_path, f"{SCENE} {then} -resume")
    assert_same(continued, whole)
    assert set(begun["/samples/wall_time"]) <= set(continued["/samples/wall_time"]), "broken anew"


def test_samples_that_leave_a_gap(tmp_path):
    """The file holds those that were asked for, ordered by number."""
    break_samples(tmp_path, f"{SCENE} -samples 2 -first_sample 5")
    found = break_samples(tmp_path, f"{SCENE} -samples 2 -first_sample 0 -resume")
    assert found["/samples/index"].tolist() == [0, 1, 5, 6]
    whole = break_samples(tmp_path, f"{SCENE} -samples 7", "whole.h5")
    assert found["/samples/peak_load"].tolist() == whole["/samples/peak_load"][[0, 1, 5, 6]].tolist()


def test_snapshots_and_network_are_kept(tmp_path):
    scene = "-lattice_size 4 -record breaks,profile,snapshot,network -record_snapshot_at 1,5"
    whole = break_samples(tmp_path, f"{scene} -samples 4", "whole.h5")
    break_samples(tmp_path, f"{scene} -samples 2")
    assert_same(break_samples(tmp_path, f"{scene} -samples 4 -resume"), whole)


def test_network_of_one_sample_continued_has_no_thresholds_of_it(tmp_path):
    scene = "-lattice_size 4 -record network"
    break_samples(tmp_path, scene)
    whole = break_samples(tmp_path, f"{scene} -samples 2", "whole.h5")
    assert_same(break_samples(tmp_path, f"{scene} -samples 2 -resume"), whole)


def test_network_of_two_samples_broken_one_by_one_has_no_thresholds(tmp_path):
    """Of which of them would they be?"""
    break_samples(tmp_path, "-lattice_size 4 -record network")
    both = break_samples(tmp_path, "-lattice_size 4 -record network -first_sample 1 -resume")
    assert both["/samples/index"].tolist() == [0, 1]
    assert "/network/bonds/threshold" not in both


def test_finished_run_is_left_as_it_is(tmp_path):
    succeed(tmp_path, f"{SCENE} -samples 3")
    before = contents(tmp_path)
    time.sleep(1.1)  # the attribute `created` has seconds
    succeed(tmp_path, f"{SCENE} -samples 3 -resume")
    assert contents(tmp_path) == before


def test_fewer_samples_than_the_file_holds(tmp_path):
    whole = break_samples(tmp_path, f"{SCENE} -samples 4")
    assert_same(break_samples(tmp_path, f"{SCENE} -samples 2 -resume"), whole, but=())


def test_nothing_to_resume_is_a_run_from_the_start(tmp_path):
    whole = break_samples(tmp_path, f"{SCENE} -samples 2", "whole.h5")
    assert_same(break_samples(tmp_path, f"{SCENE} -samples 2 -resume"), whole)


@pytest.mark.parametrize("option, theirs", [
    ("-seed 2", "1"), ("-lattice_size 5", "6"), ("-model fuse", "spring"), ("-grips clamped", "sliding"),
    ("-break_on tension", "magnitude"), ("-stop breaks=3", "failure"), ("-record breaks", "breaks,profile"),
    ("-lattice_row_spacing 2", "1"), ("-equilibrium dense", "tree"),
])
def test_other_options_are_refused(tmp_path, option, theirs):
    succeed(tmp_path, SCENE)
    refuse(tmp_path, f"{SCENE} {option} -samples 2 -resume", "-resume", option, theirs, output=None)


@pytest.mark.parametrize("begun, continued, named", [("", "-ksp_type cg", "-ksp_type"),
                                                      ("-ksp_type cg", "", "-ksp_type")])
def test_solver_option_added_or_taken_away_is_refused(tmp_path, begun, continued, named):
    succeed(tmp_path, f"{SCENE} {begun}")
    refuse(tmp_path, f"{SCENE} -samples 2 {continued} -resume", named, output=None)


def test_options_that_decide_nothing_may_change(tmp_path):
    scene = f"{SCENE} -equilibrium ksp"
    whole = break_samples(tmp_path, f"{scene} -samples 3", "whole.h5")
    succeed(tmp_path, f"{scene} -monitor none")
    succeed(tmp_path, f"{scene} -samples 3 -resume -monitor auto -ksp_view :view.txt -log_view :log.txt")
    assert_same(datasets(tmp_path / OUTPUT), whole)


def test_network_file_that_has_changed_is_refused(tmp_path):
    """The same name, another network: its samples don't belong in the same file."""
    network = small_network()
    network.write(tmp_path / "network.h5")
    scene = "-lattice file -lattice_file network.h5"
    succeed(tmp_path, scene)
    network.but(stiffness={3: 9.0}).write(tmp_path / "network.h5")
    refuse(tmp_path, f"{scene} -samples 2 -resume", "network.h5", output=None)


def wait_for(condition, process):
    """Polls; the run must go on meanwhile."""
    while not condition():
        assert process.poll() is None, f"the run ended before it could be killed: {process.stderr.read()}"
        time.sleep(0.005)


def kill_in_the_middle(folder, line, shards):
    """kill -9 as soon as so many files of finished samples are there; the run can be short."""
    process = start(folder, line)
    try:
        pause_until_samples_are_due(process)
        wait_for(lambda: len(list((folder / SHARDS).glob("*.h5"))) >= shards, process)
    finally:
        process.kill()
        process.communicate()


def test_killed_twice_and_continued(tmp_path):
    """Finished samples outlive the kill, and can be read; the rest is made up for."""
    line = "-lattice_size 32 -samples 400 -record breaks,profile -monitor none"
    kill_in_the_middle(tmp_path, line, shards=1)
    saved = datasets(tmp_path / SHARDS / "0.h5")
    assert 0 < len(saved["/samples/index"]) < 400
    assert len(datasets(tmp_path / OUTPUT)["/samples/index"]) == 0
    assert "-resume" in run(tmp_path, line).stderr
    assert list(read_run(tmp_path / OUTPUT).index) == list(saved["/samples/index"])
    kill_in_the_middle(tmp_path, line + " -resume", shards=2)
    continued = break_samples(tmp_path, line + " -resume")
    assert list(contents(tmp_path)) == [OUTPUT]
    n = len(saved["/samples/index"])
    assert continued["/samples/wall_time"][:n].tolist() == saved["/samples/wall_time"].tolist()
    assert_same(continued, break_samples(tmp_path, line, "whole.h5"))


def test_kill_leaves_no_half_written_file_behind_for_good(tmp_path):
    """What a kill in the middle of a write leaves is neither taken for samples nor kept."""
    succeed(tmp_path, f"{SCENE} -samples 2")
    (tmp_path / SHARDS).mkdir()
    for name in ("0.h5.part", "output.part"):
        (tmp_path / SHARDS / name).write_bytes((tmp_path / OUTPUT).read_bytes()[:500])
    (tmp_path / (OUTPUT + ".part")).write_text("somebody's own")
    continued = break_samples(tmp_path, f"{SCENE} -samples 4 -resume")
    assert list(contents(tmp_path)) == [OUTPUT, OUTPUT + ".part"]
    assert (tmp_path / (OUTPUT + ".part")).read_text() == "somebody's own"
    assert_same(continued, break_samples(tmp_path, f"{SCENE} -samples 4", "whole.h5"))


@pytest.mark.parametrize("line", [f"crackle {SCENE} -samples 2 -overwrite", f"crackle {SCENE} -samples 4 -resume",
                                  f"crackle_merge begun.h5 -output {OUTPUT} -overwrite",
                                  f"crackle_compare {SCENE} -compare {PROJECT}/options/solver/dense.opts -compare_repetitions 1 "
                                  f"-monitor none -output {OUTPUT} -overwrite"])
def test_what_no_run_has_made_stays_in_the_folder_of_shards(tmp_path, line):
    """Notes, folders and files named by no number are neither read nor removed; that is said in a line."""
    strange = ["3.checkpoint.txt", "a.h5", "notes.txt", "old/0.h5", "7.h5/notes.txt", "-1.h5", "x.h5.part"]
    succeed(tmp_path, f"{SCENE} -samples 2")
    (tmp_path / "begun.h5").write_bytes((tmp_path / OUTPUT).read_bytes())
    for name in strange:
        (tmp_path / SHARDS / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / SHARDS / name).write_text(name)
    (tmp_path / SHARDS / "5.h5").symlink_to(tmp_path / "begun.h5")
    for name in ("0.h5.part", "7.checkpoint.part", "output.part"):
        (tmp_path / SHARDS / name).write_text("cut short")
    result = execute(tmp_path, line)
    assert result.returncode == 0, result.stderr
    said = [line for line in result.stderr.splitlines() if " stays: " in line]
    assert len(said) == 1 and f"{SHARDS} stays: -1.h5 " in said[0], result.stderr
    left = {name: text for name, text in contents(tmp_path / SHARDS).items() if text is not None}
    assert sorted(left) == sorted(strange + ["5.h5"])
    assert all(left[name].decode() == name for name in strange)
    if line.startswith("crackle "):
        assert len(datasets(tmp_path / OUTPUT)["/samples/index"]) == (4 if "-resume" in line else 2)
    for name in sorted((tmp_path / SHARDS).rglob("*"), reverse=True):
        name.rmdir() if name.is_dir() else name.unlink()
    result = execute(tmp_path, f"crackle {SCENE} -samples 2 -overwrite")
    assert result.returncode == 0 and " stays: " not in result.stderr
    assert not (tmp_path / SHARDS).exists()


def test_solver_that_gives_up_keeps_finished_samples(tmp_path):
    """An iteration too short for the later breaks: one line on stderr; no sample, so no file in the way."""
    solver = "-ksp_type cg -pc_type none -ksp_max_it 60"
    result = run(tmp_path, f"-lattice_size 8 -samples 3 {solver} -monitor none")
    assert result.returncode == 1
    assert result.stderr.count("\n") == 1 and result.stderr.startswith("crackle: sample 0, after break ")
    assert "-ksp_max_it" in result.stderr
    assert not (tmp_path / OUTPUT).exists()
