#!/usr/bin/env python3
"""Makes figures of the paper from run files, each as PDF and PNG.

    figures.py NAME ... -i 'spring_*.h5' 'fuse_*.h5' [-o FOLDER]     figures.py --list

NAME `all` makes every one. A figure that can't be made from the runs given is told with the reason; the others are
made all the same.
"""
import argparse
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent))  # this folder's package, installed or not
from crackle.needs import need

need("h5py", "matplotlib", "numpy", "scipy")
from crackle.figures.catalogue import FIGURES, make_all
from crackle.study import read_study


def main():
    parser = argparse.ArgumentParser(description="Figures of the paper from run files, as PDF and PNG.")
    parser.add_argument("names", metavar="NAME", nargs="*", help="of --list, or: all")
    parser.add_argument("-i", "--input", nargs="+", metavar="RUN.h5", help="run files or patterns")
    parser.add_argument("-o", "--output", default=".", metavar="FOLDER")
    parser.add_argument("--list", action="store_true", help="names of all figures")
    arguments = parser.parse_args()
    if arguments.list:
        for name, kind in FIGURES.items():
            print(f"{name:28}{kind.draw.__doc__.splitlines()[0]}")
        return
    names = list(FIGURES) if "all" in arguments.names else arguments.names
    unknown = [name for name in names if name not in FIGURES]
    try:
        if not names or unknown:
            raise ValueError(f"figure {' '.join(unknown) or 'missing'}: all, or any of {' '.join(FIGURES)}")
        if not arguments.input:
            raise ValueError("no run file given: -i RUN.h5 ...")
        made = make_all(read_study(arguments.input), names, arguments.output)
    except (ValueError, OSError) as error:
        raise SystemExit(f"figures.py: {error}") from error
    if not made:
        raise SystemExit("figures.py: no figure could be made")


if __name__ == "__main__":
    main()
