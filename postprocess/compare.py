#!/usr/bin/env python3
"""Draws what crackle_compare measured.

    compare.py COMPARE.h5 [MORE.h5 ...] [-o FOLDER] [-f FIGURE]

FIGURE is one of (all of them without -f):
  work_precision  error of the forces against time per break: a point for a direct solver, for one that iterates a
                  curve whose points are the tolerances; a panel for each file
  error           error of the forces against the number of the break, at the tightest tolerance
  time            time per break against L; needs files of several sizes
  iterations      iterations of each break's solve against the number of the break
"""
import argparse
import sys
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np

from comparison_file import read_comparison

FLOOR = 1e-16  # errors of 0 are drawn here
# Colour and marker of a family, the same in every figure (Okabe and Ito's colours, and three more).
STYLES = {
    "tree": ("black", "*"), "updown": ("#D55E00", "D"), "updown_cg": ("#D55E00", "d"), "cholmod": ("#0072B2", "s"),
    "mumps": ("#56B4E9", "s"), "mumps_blr": ("#56B4E9", "v"), "woodbury": ("#CC79A7", "D"), "lagged": ("#0072B2", "o"),
    "jacobi": ("0.55", "o"), "jacobi_warm": ("0.55", "^"), "icc": ("#8C564B", "o"), "gamg": ("#009E73", "o"),
    "hypre": ("#009E73", "^"), "circulant": ("#E69F00", "o"), "dense": ("0.3", "x"),
}


def style_of(family):
    colour, marker = STYLES.get(family, ("#9467BD", "P"))
    return {"color": colour, "marker": marker, "markeredgecolor": colour}


def families(comparison):
    """Family name to its strategies, loosest tolerance first."""
    found = {}
    for strategy in comparison.strategies:
        found.setdefault(strategy.family, []).append(strategy)
    return {name: sorted(group, key=lambda s: -s.rtol if s.rtol == s.rtol else 0) for name, group in found.items()}


def draw_work_precision(comparisons):
    """Open markers: at least one of the breaks is another than the reference's."""
    columns = min(2, len(comparisons))
    rows = -(-len(comparisons) // columns)
    figure, axes = plt.subplots(rows, columns, figsize=(5.2 * columns, 4.1 * rows + 0.7), squeeze=False, sharey=True)
    handles = {}
    for panel, comparison in zip(axes.flat, comparisons):
        for name, group in families(comparison).items():
            points = [(s.ms_per_break, max(s.force_error, FLOOR), s.first_difference) for s in group
                      if np.isfinite(s.ms_per_break)]
            if not points:
                continue
            x, y, differs = map(np.array, zip(*points))
            style = style_of(name)
            line, = panel.plot(x, y, linewidth=1, markersize=9 if name == "tree" else 5, label=name, **style)
            panel.plot(x[differs > 0], y[differs > 0], linewidth=0, markersize=5, markerfacecolor="white", **style)
            handles.setdefault(name, line)
        first, last = comparison.number[0], int(comparison.reference["n_f"])
        panel.set_title(f"{comparison.title()}, breaks {first} to {last}", fontsize="medium")
        panel.set_xscale("log")
        panel.set_yscale("log")
        panel.grid(True, linewidth=0.3)
    for panel in axes.flat[len(comparisons):]:
        panel.set_axis_off()
    for panel in axes[-1]:
        panel.set_xlabel("time a break (ms)")
    for panel in axes[:, 0]:
        panel.set_ylabel("error of the forces (median)")
    figure.legend(handles.values(), handles.keys(), loc="lower center", ncol=7, fontsize="small", frameon=False)
    figure.tight_layout(rect=(0, 0.45 / (4.1 * rows + 0.7) * 1.4, 1, 1))
    return figure


def draw_series(comparison, name, label, logarithmic):
    figure, panel = plt.subplots(figsize=(7, 4.2))
    for family, group in families(comparison).items():
        tightest = group[-1]
        values = np.array(tightest.series[name], dtype=float)
        values[values < 0] = np.nan
        if name == "iterations" and np.nanmax(values, initial=0) <= 1:
            continue  # direct
        panel.plot(comparison.number, np.maximum(values, FLOOR) if logarithmic else values, linewidth=1,
                   markersize=3, label=tightest.name, **style_of(family))
    if logarithmic:
        panel.set_yscale("log")
    panel.set_xlabel("number of the break")
    panel.set_ylabel(label)
    panel.set_title(comparison.title(), fontsize="medium")
    panel.grid(True, linewidth=0.3)
    if panel.get_legend_handles_labels()[0]:
        panel.legend(fontsize="x-small", ncol=2, frameon=False)
    figure.tight_layout()
    return figure


def draw_time(comparisons):
    """One curve a family and model, at its tightest tolerance."""
    curves = {}
    for comparison in comparisons:
        size, model = int(comparison.options["-lattice_size"]), comparison.options["-model"]
        for family, group in families(comparison).items():
            curves.setdefault((model, family), []).append((size, group[-1].ms_per_break))
    figure, panel = plt.subplots(figsize=(7, 4.6))
    for (model, family), points in curves.items():
        x, y = np.array(sorted(points)).T
        panel.plot(x, y, linewidth=1, markersize=5, linestyle="-" if model == "spring" else "--",
                   label=family if model == "spring" else f"{family} (fuse)", **style_of(family))
    sizes = sorted({int(c.options["-lattice_size"]) for c in comparisons})
    panel.set_xscale("log")
    panel.set_yscale("log")
    panel.set_xticks(sizes, [str(size) for size in sizes], minor=False)
    panel.minorticks_off()
    panel.set_xlabel("L")
    panel.set_ylabel("time a break (ms)")
    panel.grid(True, linewidth=0.3)
    panel.legend(fontsize="x-small", ncol=3, frameon=False)
    figure.tight_layout()
    return figure


def figures_of(comparisons, wanted):
    """Name to figure, of those that the files are enough for; why not, for the others, goes to stderr."""
    made = {}
    sizes = {c.options["-lattice_size"] for c in comparisons}
    if wanted in (None, "work_precision"):
        made["work_precision"] = draw_work_precision(comparisons)
    if wanted in (None, "time"):
        if len(sizes) > 1:
            made["time"] = draw_time(comparisons)
        else:
            print("compare.py: no figure `time`: all files are of one size", file=sys.stderr)
    for comparison in comparisons:
        stem = Path(comparison.path).stem
        if wanted in (None, "error"):
            made[f"error_{stem}"] = draw_series(comparison, "force_error", "largest error of a force", True)
        if wanted in (None, "iterations"):
            made[f"iterations_{stem}"] = draw_series(comparison, "iterations", "iterations", False)
    return made


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("files", nargs="+")
    parser.add_argument("-o", "--output", default=".", help="folder for the pictures")
    parser.add_argument("-f", "--figure", choices=["work_precision", "error", "time", "iterations"])
    arguments = parser.parse_args()
    try:
        comparisons = [read_comparison(path) for path in arguments.files]
    except ValueError as error:
        sys.exit(f"compare.py: {error}")
    folder = Path(arguments.output)
    folder.mkdir(parents=True, exist_ok=True)
    for name, figure in figures_of(comparisons, arguments.figure).items():
        figure.savefig(folder / f"{name}.png", dpi=110)
        plt.close(figure)
        print(folder / f"{name}.png")


if __name__ == "__main__":
    main()
