#!/usr/bin/env python3
"""Exports a sample for ParaView: how its bonds break, step by step, as XDMF (with its data in HDF5 beside it).

    export_xdmf.py RUN.h5 [-s SAMPLE_INDEX] [-n STEPS] [-o CRACK.xdmf]
"""
import argparse
import os
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent))  # this folder's package, installed or not
from crackle.needs import need

need("h5py", "numpy")
from crackle.files import read_run
from crackle.files.xdmf import STEPS, export


def main():
    parser = argparse.ArgumentParser(description="Exports a sample for ParaView (XDMF).")
    parser.add_argument("run", metavar="RUN.h5")
    parser.add_argument("-s", "--sample", type=int, metavar="SAMPLE_INDEX", help="default: the first in the file")
    parser.add_argument("-n", "--steps", type=int, default=STEPS,
                        help=f"default: {STEPS}; -record snapshot gives its own")
    parser.add_argument("-o", "--output", metavar="CRACK.xdmf", help="default: RUN.xdmf")
    arguments = parser.parse_args()
    output = arguments.output or os.path.splitext(arguments.run)[0] + ".xdmf"
    try:
        if arguments.steps < 1:
            raise ValueError(f"--steps {arguments.steps}: 1 or more")
        run = read_run(arguments.run)
        if not len(run):
            raise ValueError(f"{arguments.run}: no finished sample yet")
        export(run, 0 if arguments.sample is None else run.find(arguments.sample), output, arguments.steps)
    except (ValueError, OSError) as error:
        raise SystemExit(f"export_xdmf.py: {error}") from error
    print(output)


if __name__ == "__main__":
    main()
