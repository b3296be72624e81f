"""Disks that are full, folders that go away, files that are damaged, runs in each other's way: nothing is lost."""
import resource
import signal

import pytest
from program import (LONGEST, OUTPUT, assert_same, break_samples, contents, datasets, kill, pause_until_samples_are_due, refuse,
                     run, start, succeed, wait_for)

SHARDS = OUTPUT + ".shards"
LINE = "-lattice_size 32 -samples 60 -monitor none"


def stderr_line(result):
    said = [line for line in result.stderr.splitlines() if line.startswith("crackle: ")]
    assert len(said) == 1, result.stderr
    return said[0]


@pytest.mark.parametrize("kilobytes", [4, 100])
def test_full_disk(tmp_path, kilobytes):
    """Files can't grow beyond a limit, at once or with the merge. What was done before is kept, and goes on."""
    def limit():
        resource.setrlimit(resource.RLIMIT_FSIZE, (kilobytes * 1024, kilobytes * 1024))

    before = break_samples(tmp_path, "-lattice_size 32 -samples 2 -monitor none")
    result = run(tmp_path, f"{LINE} -resume", prepare=limit)
    assert result.returncode != 0
    assert "-resume goes on" in stderr_line(result) and OUTPUT in stderr_line(result)
    assert_same(datasets(tmp_path / OUTPUT), before)
    assert not [name for name in contents(tmp_path) if name.endswith(".part")]
    assert_same(break_samples(tmp_path, f"{LINE} -resume"), break_samples(tmp_path, LINE, "whole.h5"))


def test_folder_that_can_not_be_written(tmp_path):
    """Not even root writes there."""
    refuse(tmp_path, "-lattice_size 4 -output /proc/crackle.h5", "-output", "/proc/crackle.h5", "can be written",
           output=None)


@pytest.mark.parametrize("ranks", [0, 2])
def test_folder_that_goes_away_in_the_middle(tmp_path, ranks):
    process = start(tmp_path, "-lattice_size 32 -samples 4000 -monitor none", ranks)
    wait_for(lambda: list((tmp_path / SHARDS).glob("[0-9]*.h5")), process)
    (tmp_path / SHARDS).rename(tmp_path / "elsewhere")
    _, err = process.communicate(timeout=LONGEST)
    assert process.returncode == 1 and f"crackle: could not write {SHARDS}" in err.replace(OUTPUT, "", 0), err
    (tmp_path / "elsewhere").rename(tmp_path / SHARDS)
    saved = {i for path in (tmp_path / SHARDS).glob("*.h5") for i in datasets(path)["/samples/index"]}
    assert saved
    found = break_samples(tmp_path, "-lattice_size 32 -samples 20 -resume")
    assert saved <= set(found["/samples/index"])


def leave_shards(folder):
    """A run that was killed, continued and killed again: two shards."""
    for shard in ("0.h5", "1.h5"):
        process = start(folder, "-lattice_size 32 -samples 400 -monitor none -resume")
        pause_until_samples_are_due(process)
        wait_for((folder / SHARDS / shard).exists, process)
        kill(process)


def test_truncated_shard_is_named_and_the_rest_is_kept(tmp_path):
    leave_shards(tmp_path)
    shard = tmp_path / SHARDS / "1.h5"
    shard.write_bytes(shard.read_bytes()[:-1000])
    line = "-lattice_size 32 -samples 20 -monitor none -resume"
    refuse(tmp_path, line, "1.h5", "whole", output=None)
    shard.unlink()
    succeed(tmp_path, line)
    found = datasets(tmp_path / OUTPUT)
    assert_same({"/": found["/samples/peak_load"][:20]},
                {"/": break_samples(tmp_path, "-lattice_size 32 -samples 20", "whole.h5")["/samples/peak_load"]})


def test_damaged_checkpoint_is_named(tmp_path):
    line = "-lattice_size 128 -samples 1 -monitor none -checkpoint_breaks 100 -checkpoint_every 0"
    process = start(tmp_path, line)
    kept = tmp_path / SHARDS / "0.checkpoint"
    wait_for(kept.exists, process)
    process.kill()
    process.communicate()
    kept.write_bytes(kept.read_bytes()[:2000])
    refuse(tmp_path, f"{line} -resume", "0.checkpoint", "whole", output=None)


def test_two_runs_on_one_output(tmp_path):
    """The second is told; the first doesn't notice."""
    line = "-lattice_size 32 -samples 100 -monitor none -checkpoint_breaks 100 -checkpoint_every 0"
    process = start(tmp_path, line)
    wait_for((tmp_path / OUTPUT).exists, process)  # it holds the lock by then
    process.send_signal(signal.SIGSTOP)
    refuse(tmp_path, f"{line} -resume", "-output", OUTPUT, "no other run", output=None)
    refuse(tmp_path, line, "-output", OUTPUT, "-resume", output=None)
    result = run(tmp_path, "-lattice_size 4 -overwrite")
    assert result.returncode == 1 and "no other run" in stderr_line(result)
    process.send_signal(signal.SIGCONT)
    assert process.wait(timeout=LONGEST) == 0
    assert_same(datasets(tmp_path / OUTPUT), break_samples(tmp_path, line, "whole.h5"))


def test_runs_begun_together_leave_one_whole_file(tmp_path):
    line = "-lattice_size 8 -samples 50 -monitor none"
    processes = [start(tmp_path, line) for _ in range(4)]
    ends = [(process.communicate(timeout=LONGEST)[1], process.returncode) for process in processes]
    assert 0 in [status for _, status in ends]
    assert all("-output" in said for said, status in ends if status != 0)
    assert_same(datasets(tmp_path / OUTPUT), break_samples(tmp_path, line, "whole.h5"))


@pytest.mark.parametrize("ranks", [2, 4])
def test_solver_that_gives_up_ends_all_processes_and_keeps_finished_samples(tmp_path, ranks):
    line = "-lattice_size 8 -ksp_type cg -pc_type none -ksp_max_it 60 -samples 50 -monitor none"
    result = run(tmp_path, line, ranks)
    assert result.returncode != 0 and "-ksp_max_it" in stderr_line(result)


def test_memory_that_is_not_there_is_refused_before_it_is_taken(tmp_path):
    """A matrix of 18818 x 18818 numbers, in 2 GiB of address space: both figures, and what to try."""
    def limit():
        resource.setrlimit(resource.RLIMIT_AS, (2 << 30, 2 << 30))

    result = run(tmp_path, "-lattice_size 96 -equilibrium dense -stop breaks=0 -monitor none", prepare=limit)
    assert result.returncode == 1 and contents(tmp_path) == {}
    line = stderr_line(result)
    assert "-equilibrium dense of 18818 unknowns needs 2702 MiB" in line and "ulimit -v allows 2048 MiB" in line
    assert "-ksp_type cg" in line
