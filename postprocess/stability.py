#!/usr/bin/env python3
"""Runs solvers through the extreme scenes, and tells which get every bond right and which say that they don't.

    stability.py [SCENE.opts ...] [-c CRACKLE_COMPARE] [-s SOLVER.opts,...] [-o FOLDER]

Without scenes: the project's options/extreme/*.opts, which takes some ten minutes. Leaves a comparison file for each
scene, stability.csv with a line for each scene and strategy, and the table of the README in stability.md. A scene that
names its strategies (-compare) is run with those.
"""
import argparse
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent))  # this folder's package, installed or not
from crackle.needs import need

need("h5py", "numpy", "scipy")
from crackle.study.stability import STRATEGIES, run_scenes

ABOVE = Path(__file__).resolve().parents[1]  # the project, or share/crackle of an installation
PROGRAMS = [folder / "crackle_compare" for folder in (ABOVE / "build/release", ABOVE.parents[1] / "bin")]


def main():
    options = ABOVE / "options"
    solvers = ",".join(str(options / f"solver/{strategy}.opts") for strategy in STRATEGIES)
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("scenes", nargs="*", type=Path)
    parser.add_argument("-c", "--compare", help="the program; default: the one built or installed with this script",
                        default=next(filter(Path.is_file, PROGRAMS), "crackle_compare"))
    parser.add_argument("-s", "--solvers", default=solvers)
    parser.add_argument("-o", "--output", default="stability", type=Path, help="folder for what it leaves")
    arguments = parser.parse_args()
    scenes = arguments.scenes or sorted(options.glob("extreme/*.opts"))
    try:
        rows = run_scenes(arguments.compare, scenes, arguments.solvers, arguments.output)
    except (ValueError, OSError) as error:
        raise SystemExit(f"stability.py: {error}") from error
    raise SystemExit(0 if rows else 1)


if __name__ == "__main__":
    main()
