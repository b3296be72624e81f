#!/usr/bin/env python3
"""Damages a thousand files of each kind - network, run, shard, checkpoint, comparison - and uses each in every way:
merging, -resume, breaking, reading in Python. Prints how often which came out how, and every fault.

    CRACKLE=build/release/crackle tests/run/study_damaged_files.py [files of each kind] [kind ...]

"right" (the same results to the last bit) and "refused" (status 1, the reason in one line) are as it should be. Takes
ten minutes. damage.damage(path, kind, number) makes one of them again.
"""
import collections
import sys
import tempfile
from pathlib import Path

import conftest  # pylint: disable=unused-import  # makes postprocess importable
from damage import GOOD, damaged_uses, kinds


def study(kind, files, folder):
    """Counts of verdicts by use."""
    counts = collections.defaultdict(collections.Counter)
    for number in range(files):
        for use, how, verdict, said in damaged_uses(kind, number, folder):
            counts[use][verdict] += 1
            if verdict not in GOOD:
                print(f"    {kind.name} {number}, {use}: {how}: {verdict}: {said.strip()[:300]}")
    for use, verdicts in counts.items():
        print(f"{kind.name + ', ' + use:20} {files:5}  " +
              ", ".join(f"{count} {verdict}" for verdict, count in verdicts.most_common()), flush=True)
    return sum(counts.values(), collections.Counter())


def main(words):
    files = int(words[0]) if words else 1000
    total = collections.Counter()
    with tempfile.TemporaryDirectory() as folder:
        for kind in kinds():
            if not words[1:] or kind.name in words[1:]:
                total += study(kind.make(Path(folder) / kind.name), files, folder)
    print(f"{'all':20} {sum(total.values()):5}  " +
          ", ".join(f"{count} {verdict}" for verdict, count in total.most_common()))
    return 0 if total.keys() <= set(GOOD) else 1


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
