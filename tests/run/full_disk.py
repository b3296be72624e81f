"""A disk that is really full: a tmpfs of a few pages, what is tried on it, and what may come of that.

RLIMIT_FSIZE fails at once, in write(); a full tmpfs fails as real disks do, also in pages that HDF5 keeps to the end.
"""
import functools
import os
import re
import resource
import subprocess
import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from program import datasets, execute

KIB = 1024
PAGE = 4       # KiB: what a tmpfs hands out at a time
ROOM = 65536   # KiB: what everything fits in
LONGEST = 30   # seconds
NAMES = 1000   # files and folders: more than anything here makes
SOLVERS = ",".join(str(Path(__file__).resolve().parents[2] / "options" / f"solver/{name}.opts")
                   for name in ("tree", "updown"))


class Disk:
    """A tmpfs mounted on a folder. PermissionError where that isn't allowed."""

    def __init__(self, folder):
        self.folder = Path(folder)
        self.folder.mkdir(exist_ok=True)
        self._mount("-t", "tmpfs", "-o", f"size={ROOM}k,nr_inodes={NAMES}", "tmpfs")

    def _mount(self, *words):
        result = subprocess.run(["mount", *words, self.folder], capture_output=True, text=True, check=False)
        if result.returncode != 0:
            raise PermissionError(f"a tmpfs can't be mounted here: {result.stderr.strip()}")

    def leave(self, kib=ROOM, names=NAMES):
        """From now on there is room for so much, and for so many files and folders, beyond what is there."""
        status = os.statvfs(self.folder)
        used = (status.f_blocks - status.f_bfree) * status.f_frsize // KIB
        # a size or number of 0 would mean: no limit
        self._mount("-o", f"remount,size={max(used + kib, PAGE)}k,nr_inodes={status.f_files - status.f_ffree + names}")

    def clear(self):
        self.leave()
        subprocess.run(["find", self.folder, "-mindepth", "1", "-delete"], check=True)

    def close(self):
        subprocess.run(["umount", self.folder], check=True)


@dataclass(frozen=True)
class Attempt:
    """Command lines, run in a folder of their own."""
    name: str
    line: str          # tried while there is too little room: a program and its words
    again: str         # when there is room; must leave `output` right
    output: str        # a file of the folder
    before: tuple = ()  # lines run while there is room
    ranks: int = 0     # > 0: `line` and `again` run under mpirun

    @property
    def program(self):
        return self.line.split()[0]


@dataclass(frozen=True)
class Whole:
    """What is whole before an attempt."""
    files: dict     # name to numbers
    samples: frozenset  # that the output has


RUN_8 = "crackle -lattice_size 8 -record breaks,profile -monitor none -output run.h5"
EVERY_8 = ("crackle -lattice_size 8 -record breaks,profile,snapshot,network -record_snapshot_at 1,9 -monitor none "
           "-output run.h5")
RUN_64 = ("crackle -lattice_size 64 -stop breaks=1500 -checkpoint_breaks 200 -checkpoint_every 0 -monitor none "
          "-output run.h5")
PARTS = tuple(f"crackle -lattice_size 8 -record breaks,profile -monitor none -first_sample {first} -samples 10 "
              f"-output part_{first}.h5" for first in (0, 10))
MERGE = "crackle_merge part_0.h5 part_10.h5 -output merged.h5"
UNREADABLE = (OSError, KeyError, RuntimeError, IndexError, ValueError)  # what h5py and numpy say of damaged files
MERGE_INTO = "crackle_merge part_0.h5 part_10.h5 -output part_0.h5 -overwrite"
COMPARE = f"crackle_compare -lattice_size 6 -compare {SOLVERS} -compare_repetitions 1 -monitor none -output compare.h5"
ATTEMPTS = [
    Attempt("run_8", f"{RUN_8} -samples 20", f"{RUN_8} -samples 20 -resume", "run.h5"),
    Attempt("run_8_two_processes", f"{RUN_8} -samples 20", f"{RUN_8} -samples 20 -resume", "run.h5", ranks=2),
    Attempt("resume_8", f"{RUN_8} -samples 20 -resume", f"{RUN_8} -samples 20 -resume", "run.h5",
            before=(f"{RUN_8} -samples 8",)),
    Attempt("resume_8_two_processes", f"{RUN_8} -samples 20 -resume", f"{RUN_8} -samples 20 -resume", "run.h5",
            before=(f"{RUN_8} -samples 8",), ranks=2),
    Attempt("overwrite_8", f"{RUN_8} -samples 20 -overwrite", f"{RUN_8} -samples 20 -resume", "run.h5",
            before=(f"{RUN_8} -samples 8",)),
    Attempt("every_record_8", f"{EVERY_8} -samples 5", f"{EVERY_8} -samples 5 -resume", "run.h5"),
    Attempt("run_64", RUN_64, f"{RUN_64} -resume", "run.h5"),
    Attempt("run_64_two_processes", RUN_64, f"{RUN_64} -resume", "run.h5", ranks=2),
    Attempt("merge", MERGE, f"{MERGE} -overwrite", "merged.h5", before=PARTS),
    Attempt("merge_overwrite", f"{MERGE} -overwrite", f"{MERGE} -overwrite", "merged.h5",
            before=(*PARTS, "crackle_merge part_0.h5 -output merged.h5")),
    Attempt("merge_into_a_part", MERGE_INTO, MERGE_INTO, "part_0.h5", before=PARTS),
    Attempt("compare_overwrite", f"{COMPARE} -overwrite", f"{COMPARE} -overwrite", "compare.h5", before=(COMPARE,)),
    Attempt("compare", COMPARE, f"{COMPARE} -overwrite", "compare.h5"),
]


def numbers(path):
    """What must not depend on anything: all datasets as bytes, what was timed aside."""
    timed = re.compile("/samples/wall_time|/strategies/.*/(time|total|set_up|phase)")
    return {name: (str(array.dtype), array.shape, array.tobytes())
            for name, array in datasets(path).items() if not timed.fullmatch(name)}


def samples_of(path):
    """Sample number to the sample's numbers, as bytes; of a file without breaks its rows."""
    found = datasets(path)
    offset = found.get("/samples/break_offset", np.zeros(len(found["/samples/index"]) + 1, int))
    rows = [name for name in found if name.startswith(("/samples/", "/profile/"))
            and name not in ("/samples/wall_time", "/samples/break_offset", "/samples/index")]
    breaks = [name for name in found if name.startswith("/breaks/")]
    return {int(index): ([found[name][s].tobytes() for name in sorted(rows)] +
                         [found[name][offset[s]:offset[s + 1]].tobytes() for name in sorted(breaks)])
            for s, index in enumerate(found["/samples/index"])}


def finished(folder, output):
    """The samples that are in a run's file and its shards; every file must be whole."""
    found = {}
    for path in [folder / output, *sorted((folder / f"{output}.shards").glob("*.h5"))]:
        if path.exists():
            found.update(samples_of(path))
    return found


def prepare(attempt, folder):
    """Makes the files that are whole before the attempt."""
    for line in attempt.before:
        result = execute(folder, line)
        assert result.returncode == 0, result.stderr
    files = {path.name: numbers(path) for path in folder.glob("*.h5")}
    resumed = "-resume" in attempt.line
    return Whole(files, frozenset(samples_of(folder / attempt.output) if resumed else ()))


@functools.lru_cache(maxsize=None)
def reference(attempt):
    """What the attempt leaves where there is room: its numbers, and its samples."""
    with tempfile.TemporaryDirectory() as folder:
        folder = Path(folder)
        prepare(attempt, folder)
        result = execute(folder, attempt.line)
        assert result.returncode == 0, result.stderr
        output = folder / attempt.output
        return numbers(output), samples_of(output) if attempt.program == "crackle" else {}


def is_right(attempt, folder):
    try:
        return numbers(folder / attempt.output) == reference(attempt)[0]
    except UNREADABLE:
        return False


def fault_of_the_end(attempt, result, folder):
    """How the program ended: "", or what is wrong with that."""
    if result.returncode not in (0, 1):
        return "hangs" if result.returncode is None else "crashed"
    if result.returncode == 0:
        left = [*folder.glob("*.part*"), *folder.glob("*.shards")]
        return "lied" if not is_right(attempt, folder) else "left over" if left or result.stderr else ""
    said = [line for line in result.stderr.splitlines() if line.startswith(f"{attempt.program}: ")]
    if len(said) != 1 or (attempt.ranks == 0 and result.stderr.count("\n") != 1):
        return "not one line"
    return "" if attempt.output in said[0] else "names no file"


def fault_of_what_is_left(attempt, folder, whole):
    """After a refusal: what was whole before is whole, and what is there is right."""
    expected, samples = reference(attempt)
    output = folder / attempt.output
    try:
        if any(numbers(folder / name) != whole.files[name] for name in whole.files.keys() - {attempt.output}):
            return "lost"
        if attempt.program == "crackle":
            kept = finished(folder, attempt.output)
            right = whole.samples <= kept.keys() and all(samples[i] == kept[i] for i in kept)
            return "" if right else "lost"
        kept = numbers(output) if output.exists() else None
        return "" if kept in (expected, whole.files.get(attempt.output)) else "lost"
    except UNREADABLE:
        return "left a damaged file"


def judge(attempt, folder, whole, result, make_room):
    """"right"; "told": status 1 and a line, nothing lost, and right after make_room(); or the fault."""
    fault = fault_of_the_end(attempt, result, folder)
    if result.returncode == 1 and not fault:
        fault = fault_of_what_is_left(attempt, folder, whole)
    make_room()
    if result.returncode == 0:
        return fault or "right"
    after = execute(folder, attempt.again, attempt.ranks, seconds=LONGEST)
    if after.returncode != 0 or not is_right(attempt, folder):
        return f"{fault or 'told'}, wrong after room was made"
    return fault or "told"


def try_on(disk, attempt, **room):
    """The verdict on an attempt while `disk` has that much room left, and what the program said."""
    disk.clear()
    whole = prepare(attempt, disk.folder)
    disk.leave(**room)
    result = execute(disk.folder, attempt.line, attempt.ranks, seconds=LONGEST)
    return judge(attempt, disk.folder, whole, result, disk.leave), result.stderr


def try_under_limit(folder, attempt, largest):
    """The same while files can't grow beyond `largest` bytes, in an empty folder. Not for mpirun, whose own files and
    shared memory would be limited, too.
    """
    assert attempt.ranks == 0
    def limit():
        resource.setrlimit(resource.RLIMIT_FSIZE, (largest, largest))

    whole = prepare(attempt, folder)
    result = execute(folder, attempt.line, prepare=limit, seconds=LONGEST)
    return judge(attempt, folder, whole, result, lambda: None), result.stderr


def stepped(disk, attempt, step=PAGE, limit="kib", enough=3):
    """Verdicts for room from 0 on, in steps (limit: "kib" or "names"), until it was right so many times running."""
    room, right = 0, 0
    while right < enough:
        verdict, said = try_on(disk, attempt, **{limit: room})
        yield room, verdict, said
        right = right + 1 if verdict == "right" else 0
        room += step
        assert room < 1000 * step, f"{attempt.name} doesn't fit where it should"
