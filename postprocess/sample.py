#!/usr/bin/env python3
"""Draws one sample of a run file: its force-displacement response, and its broken bonds on the lattice.

    sample.py RUN.h5 [-s SAMPLE_INDEX] [-o PICTURE.png]
"""
import argparse
import os
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent))  # this folder's package, installed or not
from crackle.needs import need

need("h5py", "matplotlib", "numpy")
from crackle.figures.sample import draw_sample
from crackle.files import read_run


def main():
    parser = argparse.ArgumentParser(description="Draws one sample of a run file.")
    parser.add_argument("run", metavar="RUN.h5")
    parser.add_argument("-s", "--sample", type=int, metavar="SAMPLE_INDEX",
                        help="sample number; default: the first in the file")
    parser.add_argument("-o", "--output", metavar="PICTURE.png", help="default: RUN.png")
    arguments = parser.parse_args()
    output = arguments.output or os.path.splitext(arguments.run)[0] + ".png"
    try:
        run = read_run(arguments.run)
        if not len(run):
            raise ValueError(f"{arguments.run}: no finished sample yet")
        s = 0 if arguments.sample is None else run.find(arguments.sample)
        draw_sample(run, s).savefig(output, dpi=200, bbox_inches="tight")
    except (ValueError, OSError) as error:
        raise SystemExit(f"sample.py: {error}") from error
    print(output)


if __name__ == "__main__":
    main()
