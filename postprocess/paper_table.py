#!/usr/bin/env python3
"""Run files beside the tables of Nukala, Zapperi and Simunovic, Phys. Rev. E 71 (2005) 066106.

    postprocess/paper_table.py paper_8.h5 paper_16.h5 ...

One line a size: mean and standard deviation of the fraction of broken bonds at the peak load (p_p) and at failure
(p_f) and of the peak load, with the paper's in brackets and the difference of the means in standard errors.
"""
import argparse
import csv
import math
from pathlib import Path

from run_file import read_run

TABLE = Path(__file__).resolve().parents[1] / "tests" / "verification" / "spring_tables.csv"
QUANTITIES = ("p_p", "p_f", "peak_load")


def read_paper():
    """L to the row of the paper's tables."""
    with open(TABLE, encoding="utf-8", newline="") as file:
        return {int(row["L"]): row for row in csv.DictReader(line for line in file if not line.startswith("#"))}


def compare(values, row, name):
    """mean (paper's), deviation (paper's), difference of the means in standard errors"""
    mean, deviation = values.mean(), values.std(ddof=1)
    theirs, their_deviation = float(row[name]), float(row[name + "_std"])
    error = math.hypot(deviation / math.sqrt(len(values)), their_deviation / math.sqrt(int(row["n_samples"])))
    return f"{mean:.4f} ({theirs:.4f}) | {deviation:.4f} ({their_deviation:.4f}) | {(mean - theirs) / error:+.1f}"


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("runs", nargs="+", metavar="RUN", help="run file of a triangular spring lattice")
    paper = read_paper()
    runs = sorted((read_run(path) for path in parser.parse_args().runs), key=lambda run: int(run.options["-lattice_size"]))
    print("| L | samples (paper) | p_p | deviation | in errors | p_f | deviation | in errors "
          "| peak load | deviation | in errors |")
    print("| --- " * 11 + "|")
    for run in runs:
        size = int(run.options["-lattice_size"])
        bonds = (3 * size + 1) * (size + 1)
        values = {"p_p": run.n_p / bonds, "p_f": run.n_f / bonds, "peak_load": run.peak_load}
        cells = " | ".join(compare(values[name], paper[size], name) for name in QUANTITIES)
        print(f"| {size} | {len(run)} ({paper[size]['n_samples']}) | {cells} |")


if __name__ == "__main__":
    main()
