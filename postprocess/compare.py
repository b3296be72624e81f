#!/usr/bin/env python3
"""Draws what crackle_compare measured.

    compare.py COMPARE.h5 [MORE.h5 ...] [-o FOLDER] [-f FIGURE]

FIGURE is one of (all of them without -f):
  work_precision  error of the forces against time per break: a point for a direct solver, for one that iterates a
                  curve whose points are the tolerances; a panel for each model and size, from all files of it
  error           error of the forces against the number of the break, at the tightest tolerance
  time            time per break against L; needs files of several sizes
  iterations      iterations of each break's solve against the number of the break
"""
import argparse
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent))  # this folder's package, installed or not
from crackle.needs import need

need("h5py", "matplotlib", "numpy", "scipy")
from crackle.figures.comparisons import FIGURES, make_figures
from crackle.files import read_comparison


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("files", nargs="+")
    parser.add_argument("-o", "--output", default=".", type=Path, help="folder for the pictures")
    parser.add_argument("-f", "--figure", choices=FIGURES)
    arguments = parser.parse_args()
    try:
        made = make_figures([read_comparison(path) for path in arguments.files], arguments.figure, arguments.output)
    except (ValueError, OSError) as error:
        raise SystemExit(f"compare.py: {error}") from error
    raise SystemExit(0 if made else 1)


if __name__ == "__main__":
    main()
