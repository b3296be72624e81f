#!/usr/bin/env python3
"""L = 32, 1000 samples, 30 kills: the same bits on 1, 2 and 4 processes, from three parts merged, and from a run that was
killed 30 times at random moments and resumed by other numbers of processes.

    CRACKLE=build/release/crackle tests/run/study_kills.py [folder]

Takes two minutes; what it leaves in `folder` (a temporary one without it) is the runs. Most kills strike before finished
samples are written, so that only checkpoints are left, every tenth later; some of the runs go under mpirun.
"""
import random
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from program import CRACKLE, assert_same, break_samples, datasets, kill, start

SCENE = "-lattice_size 32 -record breaks,profile -checkpoint_breaks 200 -checkpoint_every 0.005"
SAMPLES = 1000
KILLS = 30


def report(what, since):
    print(f"{what}: the same in every bit ({time.time() - since:.1f} s)", flush=True)


def main(folder):
    begin = time.time()
    one = break_samples(folder, f"{SCENE} -samples {SAMPLES}", "one.h5")
    print(f"one process: {SAMPLES} samples in {time.time() - begin:.1f} s", flush=True)
    for ranks in (2, 4):
        begin = time.time()
        assert_same(break_samples(folder, f"{SCENE} -samples {SAMPLES}", f"ranks_{ranks}.h5", ranks), one)
        report(f"{ranks} processes", begin)

    begin = time.time()
    parts = []
    for first, samples in ((0, 333), (333, 300), (633, 367)):
        parts.append(f"part_{first}.h5")
        break_samples(folder, f"{SCENE} -first_sample {first} -samples {samples}", parts[-1])
    subprocess.run([Path(CRACKLE).with_name("crackle_merge"), *parts, "-output", "merged.h5"], cwd=folder,
                   check=True)
    assert_same(datasets(folder / "merged.h5"), one)
    report("three parts, merged", begin)

    begin = time.time()
    chance = random.Random(32)
    line = f"{SCENE} -samples {SAMPLES} -monitor none -resume -output killed.h5"
    for number in range(KILLS):
        process = start(folder, line, ranks=chance.choice((0, 0, 2, 4)))
        time.sleep(2.6 if number % 10 == 9 else chance.uniform(0.1, 1.2))
        assert process.poll() is None, f"at its end after {number} kills: {process.communicate()[1]}"
        kill(process)
    left = sum(len(datasets(path)["/samples/index"]) for path in folder.glob("killed.h5.shards/*.h5"))
    begun = len(list(folder.glob("killed.h5.shards/*.checkpoint")))
    print(f"{KILLS} kills: {left} samples are on disk, {begun} more are begun", flush=True)
    break_samples(folder, line, "killed.h5", ranks=2)
    assert_same(datasets(folder / "killed.h5"), one)
    report(f"killed {KILLS} times", begin)


if __name__ == "__main__":
    if len(sys.argv) > 1:
        Path(sys.argv[1]).mkdir(parents=True, exist_ok=True)
        main(Path(sys.argv[1]))
    else:
        with tempfile.TemporaryDirectory() as temporary:
            main(Path(temporary))
