#!/usr/bin/env python3
"""Steps the room on a tmpfs, 4 KiB at a time, over the whole range in which runs, merges and comparisons fit or not, then
the number of files that it may hold, then RLIMIT_FSIZE, 512 bytes at a time; prints how often each came out how.

    CRACKLE=build/release/crackle tests/run/study_full_disk.py [attempt ...]

Needs the right to mount. Takes minutes. Verdicts are those of full_disk.judge: "right" and "told" are as it should be.
"""
import collections
import signal
import sys
import tempfile
from pathlib import Path

from full_disk import ATTEMPTS, Disk, stepped, try_under_limit


def steps_of_file_size(attempt):
    """RLIMIT_FSIZE from 0 on, until the attempt fits three times running."""
    largest, enough = 0, 0
    while enough < 3:
        with tempfile.TemporaryDirectory() as folder:
            verdict, said = try_under_limit(Path(folder), attempt, largest)
        yield largest, verdict, said
        enough = enough + 1 if verdict == "right" else 0
        largest += 512 if largest < 16384 else 2048


def table(name, verdicts):
    """One line of counts, and the first of each fault with what was said."""
    counts, first = collections.Counter(), {}
    for room, verdict, said in verdicts:
        counts[verdict] += 1
        first.setdefault(verdict, (room, said.strip().splitlines()[:1]))
    print(f"{name:45} {sum(counts.values()):4}  " + ", ".join(f"{count} {word}" for word, count in counts.items()),
          flush=True)
    for verdict, (room, said) in first.items():
        if verdict not in ("right", "told"):
            print(f"    {verdict}, first with {room}: {said}", flush=True)
    return counts


def main(names):
    attempts = [attempt for attempt in ATTEMPTS if not names or attempt.name in names]
    total = collections.Counter()
    with tempfile.TemporaryDirectory() as folder:
        disk = Disk(Path(folder) / "disk")
        try:
            for attempt in attempts:
                total += table(f"{attempt.name}, KiB", stepped(disk, attempt))
                total += table(f"{attempt.name}, files", stepped(disk, attempt, 1, "names"))
        finally:
            disk.close()
    for attempt in (attempt for attempt in attempts if attempt.ranks == 0):
        total += table(f"{attempt.name}, RLIMIT_FSIZE", steps_of_file_size(attempt))
    print(f"{'all':45} {sum(total.values()):4}  " + ", ".join(f"{count} {word}" for word, count in total.items()))
    return 0 if total.keys() <= {"right", "told"} else 1


if __name__ == "__main__":
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(1))  # so that the disk is unmounted
    sys.exit(main(sys.argv[1:]))
