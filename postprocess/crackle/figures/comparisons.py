"""Figures of what crackle_compare measured, by name:

  work_precision  error of the forces against time per break: a point for a direct solver, for one that iterates a
                  curve whose points are the tolerances; a panel for each model and size, from all files of it
  error           error of the forces against the number of the break, at the tightest tolerance
  time            time per break against L; needs files of several sizes
  iterations      iterations of each break's solve against the number of the break
"""
import sys
from pathlib import Path

import numpy as np

from crackle.figures.style import PANEL_HEIGHT, PANEL_WIDTH, in_style, new_figure

FIGURES = ("work_precision", "error", "time", "iterations")
FLOOR = 1e-16        # errors of 0 are drawn here
LEGEND_COLUMN = 1.1  # inches
LEGEND_ROW = 0.16
# Colour and marker of a family, the same in every figure (Okabe and Ito's colours, and four more).
STYLES = {
    "tree": ("black", "*"), "updown": ("#D55E00", "D"), "updown_cg": ("#D55E00", "d"), "cholmod": ("#0072B2", "s"),
    "mumps": ("#56B4E9", "s"), "mumps_blr": ("#56B4E9", "v"), "woodbury": ("#CC79A7", "D"), "lagged": ("#0072B2", "o"),
    "jacobi": ("0.55", "o"), "jacobi_warm": ("0.55", "^"), "icc": ("#8C564B", "o"), "gamg": ("#009E73", "o"),
    "hypre": ("#009E73", "^"), "circulant": ("#E69F00", "o"), "dense": ("0.3", "x"), "quad": ("#882255", "X"),
}
OTHER = ("#9467BD", "P")  # any solver that has no style of its own


def style_of(family):
    colour, marker = STYLES.get(family, OTHER)
    size = {"*": 7, "X": 5}.get(marker, 4)
    return {"color": colour, "marker": marker, "markeredgecolor": colour, "markersize": size}


def by_family(strategies):
    """Family name to its strategies, loosest tolerance first."""
    found = {}
    for strategy in strategies:
        found.setdefault(strategy.family, []).append(strategy)
    return {name: sorted(group, key=lambda s: -s.rtol if s.rtol == s.rtol else 0) for name, group in found.items()}


def by_scene(comparisons):
    """A list of (first comparison, strategies of all files of that model and size); of a strategy that several files
    have, that with most breaks.
    """
    scenes = {}
    for comparison in comparisons:
        _, best = scenes.setdefault(comparison.title(), (comparison, {}))
        for strategy in comparison.strategies:
            if strategy.name not in best or strategy.breaks > best[strategy.name].breaks:
                best[strategy.name] = strategy
    return [(first, list(best.values())) for first, best in scenes.values()]


def panels(count, families):
    """A figure with so many panels, two in a row, and room below for a legend of so many families."""
    columns = min(2, count)
    rows = -(-count // columns)
    legend = LEGEND_ROW * -(-families // legend_columns(columns * PANEL_WIDTH)) + 0.1
    height = rows * PANEL_HEIGHT + legend
    figure, axes = new_figure(columns, rows, height=height / rows, sharey=True)
    figure.get_layout_engine().set(rect=(0, legend / height, 1, 1 - legend / height))
    for panel in axes.flat[count:]:
        panel.set_axis_off()
    for panel in axes.flat[:count]:
        panel.set_xscale("log")
        panel.set_yscale("log")
        panel.grid(True, linewidth=0.3)
    return figure, axes


def legend_columns(width):
    return max(1, int(width / LEGEND_COLUMN))


def add_legend(figure, handles):
    figure.legend(handles.values(), handles.keys(), loc="lower center", ncol=legend_columns(figure.get_figwidth()))


def draw_work_precision(comparisons):
    """Open markers: at least one of the breaks is another than the reference's."""
    scenes = by_scene(comparisons)
    figure, axes = panels(len(scenes), len({s.family for c in comparisons for s in c.strategies}))
    handles = {}
    for panel, (comparison, strategies) in zip(axes.flat, scenes):
        for name, group in by_family(strategies).items():
            points = [(s.ms_per_break, max(s.force_error, FLOOR), s.first_difference) for s in group
                      if np.isfinite(s.ms_per_break)]
            if not points:
                continue
            x, y, differs = map(np.array, zip(*points))
            line, = panel.plot(x, y, label=name, **style_of(name))
            panel.plot(x[differs > 0], y[differs > 0], linewidth=0, **{**style_of(name), "markerfacecolor": "white"})
            handles.setdefault(name, line)
        panel.set_title(comparison.title())
    for panel in axes.flat[max(0, len(scenes) - axes.shape[1]):len(scenes)]:  # those with none below
        panel.set_xlabel("time a break (ms)")
    for panel in axes[:, 0]:
        panel.set_ylabel("error of the forces (median)")
    add_legend(figure, handles)
    return figure


def draw_series(comparison, name, label, logarithmic):
    """One quantity of all strategies, each at its tightest tolerance, along the breaks."""
    figure, axes = new_figure(width=1.6 * PANEL_WIDTH)
    panel = axes[0, 0]
    for family, group in by_family(comparison.strategies).items():
        tightest = group[-1]
        values = np.array(tightest.series[name], dtype=float)
        values[values < 0] = np.nan
        if name == "iterations" and np.nanmax(values, initial=0) <= 1:
            continue  # direct
        panel.plot(comparison.number, np.maximum(values, FLOOR) if logarithmic else values, label=tightest.name,
                   **style_of(family))
    if logarithmic:
        panel.set_yscale("log")
    panel.set_xlabel("number of the break")
    panel.set_ylabel(label)
    panel.set_title(comparison.title())
    panel.grid(True, linewidth=0.3)
    if panel.get_legend_handles_labels()[0]:
        panel.legend(loc="center left", bbox_to_anchor=(1, 0.5))
    return figure


def draw_time(comparisons):
    """A panel a model, one curve a family, at its tightest tolerance."""
    curves = {}
    for comparison, strategies in by_scene(comparisons):
        families = curves.setdefault(comparison.options["-model"], {})
        for family, group in by_family(strategies).items():
            families.setdefault(family, []).append((comparison.size, group[-1].ms_per_break))
    figure, axes = panels(len(curves), len({family for families in curves.values() for family in families}))
    handles = {}
    for panel, (model, families) in zip(axes.flat, curves.items()):
        for family, points in families.items():
            x, y = np.array(sorted(points)).T
            line, = panel.plot(x, y, **style_of(family))
            handles.setdefault(family, line)
        sizes = sorted({size for points in families.values() for size, _ in points})
        panel.set_xticks(sizes, [str(size) for size in sizes])
        panel.minorticks_off()
        panel.set_xlabel("L")
        panel.set_title(model)
    axes[0, 0].set_ylabel("time a break (ms)")
    add_legend(figure, handles)
    return figure


def figures_of(comparisons, wanted):
    """Name to figure, of those that the files are enough for; why not, for the others, goes to stderr."""
    made = {}
    sized = [c for c in comparisons if c.size is not None]
    if wanted in (None, "work_precision"):
        made["work_precision"] = draw_work_precision(comparisons)
    if wanted in (None, "time"):
        if len({c.size for c in sized}) > 1:
            made["time"] = draw_time(sized)
        else:
            print("compare.py: no figure `time`: it needs files of several sizes", file=sys.stderr)
    for comparison in comparisons:
        stem = Path(comparison.path).stem
        if wanted in (None, "error"):
            made[f"error_{stem}"] = draw_series(comparison, "force_error", "largest error of a force", True)
        if wanted in (None, "iterations"):
            made[f"iterations_{stem}"] = draw_series(comparison, "iterations", "iterations", False)
    return made


def make_figures(comparisons, wanted, folder):
    """FOLDER/NAME.png of the figure wanted, or of all (None), telling each; returns how many could be made."""
    folder.mkdir(parents=True, exist_ok=True)
    with in_style():
        figures = figures_of(comparisons, wanted)
        for name, figure in figures.items():
            figure.savefig(folder / f"{name}.png", dpi=180)
            print(folder / f"{name}.png")
    return len(figures)
