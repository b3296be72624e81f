"""Whatever the number of processes, whatever ends them and wherever a run goes on: the same bits."""
import random
import re
import signal
import time

import pytest
from program import (LONGEST, OUTPUT, assert_same, assert_same_breaks, attributes, break_samples, contents, datasets,
                     kill, options_of, pause_until_samples_are_due, run, start, succeed)

SCENE = "-lattice_size 9 -record breaks,profile"
# every tenth break is a place to go on from, and is kept at once
CHECKPOINTS = "-checkpoint_breaks 10 -checkpoint_every 0"
SHARDS = OUTPUT + ".shards"


@pytest.mark.parametrize("ranks, more", [(1, ""), (2, ""), (4, ""), (2, "-equilibrium ksp"),
                                         (4, "-model fuse -record breaks,snapshot -record_snapshot_at 2,9")])
def test_any_number_of_processes(tmp_path, ranks, more):
    line = f"{SCENE} {more} -samples 60"
    assert_same(break_samples(tmp_path, line, "ranks.h5", ranks), break_samples(tmp_path, line, "one.h5"))


def test_more_processes_than_samples(tmp_path):
    assert_same(break_samples(tmp_path, f"{SCENE} -samples 2", "four.h5", 4),
                break_samples(tmp_path, f"{SCENE} -samples 2", "one.h5"))


def test_resumed_by_other_numbers_of_processes(tmp_path):
    whole = break_samples(tmp_path, f"{SCENE} -samples 50", "whole.h5")
    for samples, ranks in ((10, 2), (20, 0), (40, 4), (50, 3)):
        found = break_samples(tmp_path, f"{SCENE} -samples {samples} -resume", ranks=ranks)
    assert_same(found, whole)
    assert sorted(contents(tmp_path)) == [OUTPUT, "whole.h5"]


def test_report_sums_all_processes(tmp_path):
    one = succeed(tmp_path, f"{SCENE} -samples 40 -output one.h5").stdout
    two = succeed(tmp_path, f"{SCENE} -samples 40 -output two.h5", ranks=2).stdout
    for what in (r"peak load +[\d.]+ \+- [\d.]+", r"n_f +[\d.]+ \+- [\d.]+", r"\d+ breaks,"):
        assert re.search(what, one).group() == re.search(what, two).group()
    assert "on 2 processes" in two and two.count("-lattice_size 9\n") == 1


# ---- several sizes

def test_each_size_is_written_as_alone(tmp_path):
    succeed(tmp_path, "-lattice_size 4,10,7 -samples 20,3,8 -first_sample 0,5,1 -seed 3,2,9 -monitor none "
                      "-output paper.h5", ranks=2)
    assert sorted(contents(tmp_path)) == ["paper_10.h5", "paper_4.h5", "paper_7.h5"]
    for size, samples, first, seed in ((4, 20, 0, 3), (10, 3, 5, 2), (7, 8, 1, 9)):
        alone = break_samples(tmp_path, f"-lattice_size {size} -samples {samples} -first_sample {first} -seed {seed}",
                              f"alone_{size}.h5")
        assert_same(datasets(tmp_path / f"paper_{size}.h5"), alone)
        ours, theirs = options_of(tmp_path / f"paper_{size}.h5"), options_of(tmp_path / f"alone_{size}.h5")
        assert {**ours, "-output": ""} == {**theirs, "-output": ""}
        assert ours["-output"] == f"paper_{size}.h5"


def test_one_number_of_samples_for_all_sizes(tmp_path):
    """A size of such a run can be continued alone."""
    succeed(tmp_path, "-lattice_size 3,5 -samples 4 -output a.run")
    assert len(datasets(tmp_path / "a_3.run")["/samples/index"]) == 4
    found = break_samples(tmp_path, "-lattice_size 5 -samples 6 -resume", "a_5.run")
    assert_same(found, break_samples(tmp_path, "-lattice_size 5 -samples 6", "whole.h5"))


# ---- several processes a sample

@pytest.mark.parametrize("solver, alone", [
    ("", "-ksp_type preonly -pc_type cholesky -pc_factor_mat_solver_type mumps"),
    ("-ksp_type cg -pc_type hypre", "-equilibrium ksp"),
    ("-ksp_type cg -pc_type bjacobi -model fuse", "-model fuse -equilibrium ksp"),
])
def test_processes_that_share_a_sample_break_the_same_bonds(tmp_path, solver, alone):
    """Loads to rounding, or to what an iteration to 1e-12 leaves: the solver sums in another order."""
    expected = break_samples(tmp_path, f"-lattice_size 5 -samples 2 {alone}", "one.h5")
    shared = f"-lattice_size 5 -samples 2 -ensemble_ranks_per_sample 2 {solver}"
    found = break_samples(tmp_path, shared, "two.h5", ranks=2)
    assert_same_breaks(found, expected, 1e-9 if "cg" in solver else 1e-11)
    if not solver:
        assert_same(break_samples(tmp_path, shared, "four.h5", ranks=4), found)


@pytest.mark.parametrize("line, ranks, word", [
    ("-ensemble_ranks_per_sample 2", 3, "3"), ("-ensemble_ranks_per_sample 2", 0, "divisor"),
    ("-ensemble_ranks_per_sample 2 -equilibrium tree", 2, "ksp"),
    ("-ensemble_ranks_per_sample 2 -pc_type updown", 2, "mumps")])
def test_groups_that_can_not_be(tmp_path, line, ranks, word):
    result = run(tmp_path, line, ranks)
    assert result.returncode != 0
    said = [text for text in result.stderr.splitlines() if text.startswith("crackle: ")]
    assert len(said) == 1 and word in said[0].lower()
    assert not contents(tmp_path)


# ---- kills

def kill_at_random(folder, line, kills, ranks=0, longest=0.2):
    """Starts the run again and again, and kills it; True when it came to its end before the last kill."""
    chance = random.Random(7)
    for _ in range(kills):
        process = start(folder, line, ranks)
        time.sleep(chance.uniform(0.05, longest))
        if process.poll() is not None:
            assert process.returncode == 0, process.communicate()[1]
            return True
        kill(process)
    return False


@pytest.mark.parametrize("solver", ["", "-equilibrium ksp"])
def test_killed_thirty_times(tmp_path, solver):
    """Samples in the middle of which it was killed go on there."""
    line = f"-lattice_size 20 -samples 12 -record breaks,profile -monitor none {CHECKPOINTS} {solver}"
    whole = break_samples(tmp_path, line, "whole.h5")
    kill_at_random(tmp_path, f"{line} -resume", 30 if not solver else 5)
    assert_same(break_samples(tmp_path, f"{line} -resume"), whole)
    assert sorted(contents(tmp_path)) == [OUTPUT, "whole.h5"]


def test_processes_killed_and_continued(tmp_path):
    line = f"-lattice_size 20 -samples 12 -monitor none {CHECKPOINTS}"
    whole = break_samples(tmp_path, line, "whole.h5")
    kill_at_random(tmp_path, f"{line} -resume", 3, ranks=2, longest=0.8)
    assert_same(break_samples(tmp_path, f"{line} -resume", ranks=3), whole)


def wait_for(condition, process):
    while not condition():
        assert process.poll() is None, f"the run ended too early: {process.communicate()[1]}"
        time.sleep(0.005)


def test_sample_goes_on_from_its_checkpoint(tmp_path):
    """What was kept is not broken again: the summary counts the breaks of this run."""
    line = "-lattice_size 128 -samples 1 -monitor none -checkpoint_breaks 100 -checkpoint_every 0"
    process = start(tmp_path, line)
    kept = tmp_path / SHARDS / "0.checkpoint"
    wait_for(kept.exists, process)
    kill(process)
    begun = datasets(kept)
    breaks = begun["/samples/n_f"][0]
    assert breaks % 100 == 0 and len(begun["/breaks/bond"]) == breaks
    result = succeed(tmp_path, f"{line} -resume")
    whole = break_samples(tmp_path, line, "whole.h5")
    assert f"{whole['/samples/n_f'][0] - breaks} breaks," in result.stdout
    assert_same(datasets(tmp_path / OUTPUT), whole)


# ---- signals

def interrupt(folder, line, send, ranks=0):
    """Sends a signal to a run in its middle: what it says and its exit status."""
    process = start(folder, line, ranks)
    if ranks == 0:
        pause_until_samples_are_due(process)
    wait_for(lambda: list((folder / SHARDS).glob("[0-9]*.h5")), process)
    send(process)
    out, err = process.communicate(timeout=LONGEST)
    return process.returncode, out, err


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_signal_ends_a_run_with_what_is_done(tmp_path, number):
    line = "-lattice_size 16 -samples 20000"
    status, out, err = interrupt(tmp_path, line, lambda process: process.send_signal(number))
    assert status == 128 + number and "-resume" in out, err
    found = datasets(tmp_path / OUTPUT)
    done = len(found["/samples/index"])
    assert 0 < done < 20000 and f"{done} samples, mean" in out
    assert list(contents(tmp_path)) == [OUTPUT]
    succeed(tmp_path, f"-lattice_size 16 -samples {done + 3} -resume")
    assert_same(datasets(tmp_path / OUTPUT), break_samples(tmp_path, f"-lattice_size 16 -samples {done + 3}", "whole.h5"))


def test_second_signal_ends_at_once(tmp_path):
    def twice(process):
        process.send_signal(signal.SIGSTOP)  # both come together
        process.send_signal(signal.SIGINT)
        process.send_signal(signal.SIGTERM)
        process.send_signal(signal.SIGCONT)

    status, out, _ = interrupt(tmp_path, "-lattice_size 16 -samples 20000", twice)
    assert status in (-signal.SIGINT, -signal.SIGTERM) and "mean" not in out


def test_signal_to_mpirun_loses_nothing(tmp_path):
    line = "-lattice_size 16 -samples 20000"
    status, _, _ = interrupt(tmp_path, line, lambda process: process.send_signal(signal.SIGTERM), ranks=2)
    assert status != 0
    found = sum(len(datasets(path)["/samples/index"]) for path in tmp_path.rglob("*.h5"))
    assert 0 < found < 20000


def test_signal_keeps_a_sample_where_it_settled_last(tmp_path):
    line = "-lattice_size 128 -samples 1 -checkpoint_breaks 200 -checkpoint_every 0.1"
    process = start(tmp_path, line)
    wait_for((tmp_path / SHARDS / "0.checkpoint").exists, process)
    process.send_signal(signal.SIGTERM)
    process.communicate(timeout=LONGEST)
    assert process.returncode == 128 + signal.SIGTERM
    assert sorted(contents(tmp_path)) == [OUTPUT, SHARDS, SHARDS + "/0.checkpoint"]
    succeed(tmp_path, f"{line} -resume")
    assert_same(datasets(tmp_path / OUTPUT), break_samples(tmp_path, line, "whole.h5"))


def test_progress_elsewhere_than_on_a_terminal_is_plain_lines(tmp_path):
    result = succeed(tmp_path, f"{SCENE} -samples 30", ranks=2)
    lines = [line for line in result.stderr.splitlines() if "samples" in line]
    assert re.fullmatch(r"30 of 30 samples, [\d.e+]+ a second, 0s left, mean peak load [\d.]+ \+- [\d.]+", lines[-1])
    assert "\r" not in result.stderr and "\033" not in result.stderr
    mean = datasets(tmp_path / OUTPUT)["/samples/peak_load"].mean()
    assert f"mean peak load {mean:.4f}" in lines[-1]
