"""What every program does at its beginning and its end, whatever it is asked for."""
import resource
import signal
import subprocess
from pathlib import Path

import pytest
from program import (CRACKLE, LONGEST, OUTPUT, break_samples, contents, datasets, environment, run, start, wait_for)

PROGRAMS = ["crackle", "crackle_compare", "crackle_merge"]


def call(folder, program, words, **more):
    return subprocess.run([Path(CRACKLE).with_name(program), *words.split()], cwd=folder, env=environment(), text=True,
                          stdin=subprocess.DEVNULL, stderr=subprocess.PIPE, timeout=LONGEST, check=False, **more)


@pytest.mark.parametrize("program", PROGRAMS)
def test_help_and_version_by_any_name(tmp_path, program):
    for word in ("-h", "-help", "--help"):
        result = call(tmp_path, program, word, stdout=subprocess.PIPE)
        assert result.returncode == 0 and not result.stderr, result.stderr
        assert "-output" in result.stdout and "-overwrite" in result.stdout
    for word in ("-version", "--version", "-V"):
        result = call(tmp_path, program, word, stdout=subprocess.PIPE)
        assert result.returncode == 0 and not result.stderr, result.stderr
        first, second, *_ = result.stdout.splitlines()
        assert first.split()[0] == program and first.split()[1][0].isdigit()
        assert "PETSc 3" in second and "HDF5 1" in second
    assert not contents(tmp_path)


@pytest.mark.parametrize("program", ["crackle", "crackle_compare"])
def test_reader_of_the_help_may_leave(tmp_path, program):
    """By the system's signal for that, with no word about it; or it was all read before."""
    for _ in range(5):
        result = subprocess.run(["bash", "-c", f"{Path(CRACKLE).with_name(program)} -help | head -1; exit ${{PIPESTATUS[0]}}"],
                                cwd=tmp_path, env=environment(), text=True, capture_output=True, check=False)
        assert result.returncode in (0, 128 + signal.SIGPIPE) and not result.stderr, result.stderr


@pytest.mark.parametrize("program, words", [("crackle", "-lattice_size 4 -monitor none"), ("crackle", "-help"),
                                            ("crackle_merge", "-help"), ("crackle_compare", "-version")])
def test_standard_output_that_is_full(tmp_path, program, words):
    with open("/dev/full", "w", encoding="utf-8") as full:
        result = call(tmp_path, program, words, stdout=full)
    assert result.returncode == 1
    assert result.stderr.startswith(f"{program}: could not write standard output"), result.stderr
    assert result.stderr.count("\n") == 1


def test_hang_up_ends_with_what_is_done(tmp_path):
    """Like an interrupt; not under nohup, which lets it go on."""
    process = start(tmp_path, "-lattice_size 32 -samples 4000 -monitor none")
    wait_for(lambda: list((tmp_path / (OUTPUT + ".shards")).glob("[0-9]*.h5")), process)
    process.send_signal(signal.SIGHUP)
    out, err = process.communicate(timeout=30)
    assert process.returncode == 128 + signal.SIGHUP and not err, err
    assert "-resume goes on" in out
    assert 0 < len(datasets(tmp_path / OUTPUT)["/samples/index"]) < 4000


def test_hang_up_that_is_ignored(tmp_path):
    line = "-lattice_size 32 -samples 60 -monitor none -checkpoint_breaks 100 -checkpoint_every 0"
    process = subprocess.Popen(["nohup", CRACKLE, *line.split()], cwd=tmp_path, env=environment(), text=True,
                               stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.PIPE)
    wait_for((tmp_path / (OUTPUT + ".shards") / "0.checkpoint").exists, process)
    process.send_signal(signal.SIGHUP)
    process.communicate(timeout=30)
    assert process.returncode == 0
    assert len(datasets(tmp_path / OUTPUT)["/samples/index"]) == 60


def test_refusal_is_all_that_is_printed(tmp_path):
    break_samples(tmp_path, "-lattice_size 2")
    for line in ("-lattice_size 2", "-lattice_size 2 -ksp_type crooked", "-lattice_size 2 -outptu x",
                 "-lattice_size 2 -output no/x.h5"):
        result = run(tmp_path, line)
        assert result.returncode == 1 and not result.stdout and result.stderr.count("\n") == 1, result.stdout


@pytest.mark.parametrize("kilobytes, line", [(500_000, "-lattice_size 256"), (420_000, "-lattice_size 4"),
                                             (700_000, "-lattice_size 2000")])
def test_too_little_memory(tmp_path, kilobytes, line):
    """Says so, or works; how much a process takes before it begins is the system's."""
    def limit():
        resource.setrlimit(resource.RLIMIT_AS, (kilobytes * 1024, kilobytes * 1024))

    result = run(tmp_path, f"{line} -stop breaks=1 -monitor none", prepare=limit)
    if result.returncode == 0:
        return
    assert result.returncode in (1, 127), result.stderr  # 127: not even the libraries find room
    if result.returncode == 1:
        assert result.stderr.count("\n") == 1 and "memory" in result.stderr, result.stderr
