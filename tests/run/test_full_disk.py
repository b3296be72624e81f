"""On a full disk nothing lies, nothing crashes, nothing is lost, and what is written when there is room again is right.

A tmpfs of so many pages; study_full_disk.py takes every size, here are some of them.
"""
from pathlib import Path

import pytest
from full_disk import ATTEMPTS, COMPARE, PARTS, RUN_8, Disk, numbers, stepped, try_on, try_under_limit
from program import execute

STEPS = {0: 20, 2: 60}  # KiB, by processes under mpirun, which take long to start
BY_NAME = {attempt.name: attempt for attempt in ATTEMPTS}
EVERY = pytest.mark.parametrize("name", BY_NAME)


@pytest.fixture(name="disk", scope="module")
def fixture_disk(tmp_path_factory):
    try:
        disk = Disk(tmp_path_factory.mktemp("full") / "disk")
    except PermissionError as error:
        pytest.skip(str(error))
    yield disk
    disk.close()


def assert_good(name, room, verdict, said):
    assert verdict in ("right", "told"), f"{name}, room {room}: {verdict}: {said}"


@EVERY
def test_room_for_some_of_it(disk, name):
    """From no room at all to enough."""
    attempt = BY_NAME[name]
    verdicts = set()
    for room, verdict, said in stepped(disk, attempt, STEPS[attempt.ranks], enough=1):
        assert_good(name, room, verdict, said)
        verdicts.add(verdict)
    assert verdicts == {"right", "told"}


@EVERY
def test_no_room_for_another_file(disk, name):
    """Nor a folder: what the disk holds it holds."""
    verdict, said = try_on(disk, BY_NAME[name], names=0)
    assert_good(name, 0, verdict, said)
    assert verdict == "told"


@pytest.mark.parametrize("name", [name for name in BY_NAME if BY_NAME[name].ranks == 0])
def test_limit_of_the_shell_on_file_sizes(tmp_path, name):
    """ulimit -f: neither a signal nor its consequences end the program."""
    attempt = BY_NAME[name]
    for largest in (0, 8192):
        folder = Path(tmp_path) / str(largest)
        folder.mkdir()
        verdict, said = try_under_limit(folder, attempt, largest)
        assert_good(name, largest, verdict, said)
        assert verdict == "told"


@pytest.mark.parametrize("line, output", [(f"{RUN_8} -samples 2", "run.h5"), (COMPARE, "compare.h5"),
                                          ("crackle_merge part_0.h5 -output merged.h5", "merged.h5"),
                                          ("crackle -help", None)])
def test_words_that_can_not_be_written(tmp_path, line, output):
    """Standard output on a full disk: told, with status 1; what belongs in files is there."""
    if "merge" in line:
        execute(tmp_path, PARTS[0])
    with open("/dev/full", "wb") as full:
        result = execute(tmp_path, line, out=full)
    program = line.split()[0]
    assert result.returncode == 1 and result.stderr.count("\n") == 1, result.stderr
    assert result.stderr.startswith(f"{program}: ") and "output" in result.stderr
    if output:
        whole = numbers(tmp_path / output)
        (tmp_path / output).unlink()
        assert execute(tmp_path, line).returncode == 0
        assert whole == numbers(tmp_path / output)
