"""Figures of what crackle_compare measured, by name:

  work_precision  error of the forces against time per break: a point for a direct solver, for one that iterates a
                  curve whose points are the tolerances; a panel for each model and size, from all files of it
  error           error of the forces against the number of the break, at the tightest tolerance
  time            time per break against L; needs files of several sizes
  iterations      iterations of each break's solve against the number of the break
"""
import sys
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np

FIGURES = ("work_precision", "error", "time", "iterations")
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


def by_family(strategies):
    """Family name to its strategies, loosest tolerance first."""
    found = {}
    for strategy in strategies:
        found.setdefault(strategy.family, []).append(strategy)
    return {name: sorted(group, key=lambda s: -s.rtol if s.rtol == s.rtol else 0) for name, group in found.items()}


def by_scene(comparisons):
    """Title to the strategies of all files of that model and size; of one that several have, that with most breaks."""
    scenes = {}
    for comparison in comparisons:
        best = scenes.setdefault(comparison.title(), {})
        for strategy in comparison.strategies:
            if strategy.name not in best or strategy.breaks > best[strategy.name].breaks:
                best[strategy.name] = strategy
    return {title: list(best.values()) for title, best in scenes.items()}


def panels(count, columns):
    """A figure with a grid of panels, room for a legend below; the panels that are needed."""
    columns = min(columns, count)
    rows = -(-count // columns)
    height = 4.1 * rows + 0.7
    figure, axes = plt.subplots(rows, columns, figsize=(5.2 * columns, height), squeeze=False, sharey=True)
    for panel in axes.flat[count:]:
        panel.set_axis_off()
    for panel in axes.flat[:count]:
        panel.set_xscale("log")
        panel.set_yscale("log")
        panel.grid(True, linewidth=0.3)
    return figure, axes


def add_legend(figure, handles):
    columns = int(1.3 * figure.get_figwidth() / 2)
    figure.legend(handles.values(), handles.keys(), loc="lower center", ncol=columns, fontsize="small", frameon=False)
    rows = -(-len(handles) // columns)
    figure.tight_layout(rect=(0, (0.22 * rows + 0.15) / figure.get_figheight(), 1, 1))


def draw_work_precision(comparisons):
    """Open markers: at least one of the breaks is another than the reference's."""
    scenes = by_scene(comparisons)
    figure, axes = panels(len(scenes), 2)
    handles = {}
    for panel, (title, strategies) in zip(axes.flat, scenes.items()):
        for name, group in by_family(strategies).items():
            points = [(s.ms_per_break, max(s.force_error, FLOOR), s.first_difference) for s in group
                      if np.isfinite(s.ms_per_break)]
            if not points:
                continue
            x, y, differs = map(np.array, zip(*points))
            style = style_of(name)
            line, = panel.plot(x, y, linewidth=1, markersize=9 if name == "tree" else 5, label=name, **style)
            panel.plot(x[differs > 0], y[differs > 0], linewidth=0, markersize=5, markerfacecolor="white", **style)
            handles.setdefault(name, line)
        panel.set_title(title, fontsize="medium")
    for panel in axes[-1]:
        panel.set_xlabel("time a break (ms)")
    for panel in axes[:, 0]:
        panel.set_ylabel("error of the forces (median)")
    add_legend(figure, handles)
    return figure


def draw_series(comparison, name, label, logarithmic):
    figure, panel = plt.subplots(figsize=(8, 4.2))
    for family, group in by_family(comparison.strategies).items():
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
        panel.legend(fontsize="x-small", frameon=False, loc="center left", bbox_to_anchor=(1, 0.5))
    figure.tight_layout()
    return figure


def draw_time(comparisons):
    """A panel a model, one curve a family, at its tightest tolerance."""
    curves = {}
    for title, strategies in by_scene(comparisons).items():
        model, size = title.split(", L = ")
        for family, group in by_family(strategies).items():
            curves.setdefault(model, {}).setdefault(family, []).append((int(size), group[-1].ms_per_break))
    figure, axes = panels(len(curves), 2)
    handles = {}
    for panel, (model, families) in zip(axes.flat, curves.items()):
        for family, points in families.items():
            x, y = np.array(sorted(points)).T
            line, = panel.plot(x, y, linewidth=1, markersize=9 if family == "tree" else 5, **style_of(family))
            handles.setdefault(family, line)
        sizes = sorted({size for points in families.values() for size, _ in points})
        panel.set_xticks(sizes, [str(size) for size in sizes])
        panel.minorticks_off()
        panel.set_xlabel("L")
        panel.set_title(model, fontsize="medium")
    axes[0, 0].set_ylabel("time a break (ms)")
    add_legend(figure, handles)
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


def make_figures(comparisons, wanted, folder):
    """FOLDER/NAME.png of the figure wanted, or of all (None), telling each."""
    folder.mkdir(parents=True, exist_ok=True)
    for name, figure in figures_of(comparisons, wanted).items():
        figure.savefig(folder / f"{name}.png", dpi=110)
        plt.close(figure)
        print(folder / f"{name}.png")
