"""How every figure looks: one colour and marker a size, spring filled and fuse open, panels for print.

Figures are made without pyplot, so that whoever imports this keeps the backend and the style that are set. Draw and
save within in_style().
"""
import matplotlib
import numpy as np
from matplotlib.figure import Figure
from scipy.stats import norm

from crackle.study.ensembles import MODELS, Missing

PANEL_WIDTH, PANEL_HEIGHT = 3.5, 2.9  # inches: a journal's column
MARKERS = "osD^v<>ph*"
REFERENCE = dict(color="0.25", linewidth=1.0, linestyle="--", zorder=5)
NAMES = {"spring": "springs", "fuse": "fuses"}
MODEL_COLOURS = {"spring": "#0072B2", "fuse": "#D55E00"}  # Okabe and Ito: told apart also by the colour-blind
RC = {"font.size": 8.5, "axes.labelsize": 9, "axes.titlesize": 9, "legend.fontsize": 7, "xtick.labelsize": 8,
      "ytick.labelsize": 8, "axes.linewidth": 0.7, "lines.linewidth": 1.1, "lines.markersize": 3.2,
      "xtick.direction": "in", "ytick.direction": "in", "xtick.top": True, "ytick.right": True,
      "legend.frameon": False, "legend.handlelength": 1.6, "legend.labelspacing": 0.25,
      "mathtext.fontset": "dejavusans", "pdf.fonttype": 42, "svg.fonttype": "none"}


def in_style():
    """A context in which figures get the style of all."""
    return matplotlib.rc_context(RC)


def new_figure(columns=1, rows=1, width=PANEL_WIDTH, height=PANEL_HEIGHT, **options):
    """Figure and axes [rows, columns]."""
    figure = Figure(figsize=(width * columns, height * rows), layout="constrained")
    figure.notes = []
    return figure, figure.subplots(rows, columns, squeeze=False, **options)


def side_by_side(draw_panel, rows=1, height=PANEL_HEIGHT, sharey=False):
    """draw_panel(axes, model) for every model that has runs, in columns; axes: one, or [rows] of them.

    A model whose panel can't be made is left out with the reason in figure.notes. Raises Missing if none can.
    """
    models, notes = list(MODELS), []
    while models:
        figure, axes = new_figure(len(models), rows, height=height, sharey="row" if sharey else False)
        failed = []
        for column, model in enumerate(models):
            try:
                draw_panel(axes[0, column] if rows == 1 else axes[:, column], model)
                axes[0, column].set_title(NAMES[model] + axes[0, column].get_title())
            except Missing as reason:
                failed.append(model)
                notes.append(f"{NAMES[model]}: {reason}")
        if not failed:
            figure.notes += notes
            return figure
        models = [model for model in models if model not in failed]
    raise Missing("; ".join(notes))


def size_style(study, ensemble):
    """Colour and marker of a size, the same in all figures of a study."""
    sizes = sorted({e.size for e in study.all()})
    place = sizes.index(ensemble.size)
    colour = matplotlib.colormaps["viridis"](0.9 * place / max(1, len(sizes) - 1))
    face = colour if ensemble.model == "spring" else "white"
    return dict(color=colour, marker=MARKERS[place % len(MARKERS)], markerfacecolor=face, markeredgewidth=0.7)


def size_label(ensemble):
    return f"$L={ensemble.size}$"


def spread_probabilities(p, points=40):
    """Indices of about so many of ascending probabilities, evenly spaced in Phi^-1: tails as dense as the middle."""
    score = np.linspace(norm.ppf(p[0]), norm.ppf(p[-1]), points)
    return np.unique(np.searchsorted(p, norm.cdf(score)).clip(max=len(p) - 1))


def thin(values, most=60):
    """Indices of at most so many of sorted values, evenly spaced, both ends among them."""
    return np.unique(np.linspace(0, len(values) - 1, min(most, len(values))).round().astype(int))


def interval_text(estimate):
    """0.915 [0.913, 0.917], as many digits as the interval supports."""
    width = max(estimate.high - estimate.low, 1e-12)
    digits = int(np.clip(1 - np.floor(np.log10(width)), 0, 6))
    return f"{estimate.value:.{digits}f} [{estimate.low:.{digits}f}, {estimate.high:.{digits}f}]"


def inset(axes, bounds):
    """Axes inside axes, with small labels."""
    small = axes.inset_axes(bounds)
    small.tick_params(labelsize=6, pad=1.5)
    small.xaxis.label.set_size(7)
    small.yaxis.label.set_size(7)
    small.xaxis.labelpad = small.yaxis.labelpad = 1
    return small
