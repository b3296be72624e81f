"""One sample of a run file: its force-displacement response, and its broken bonds on the lattice."""
import numpy as np
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from crackle.statistics.response import envelope

# Told apart also by the colour-blind and in grey print (Okabe and Ito).
INTACT, BEFORE, AFTER = "0.80", "#0072B2", "#D55E00"
# The last load paths of a spring network stretch a hundred times as far as at the peak load and carry next to
# nothing: the displacement axis ends at this multiple of the displacement at the peak.
TAIL = 4.0
JOINED = 1000  # up to so many breaks are joined by a line; of more, the line would be a grey blot
LABELS = {  # load and displacement, by -model
    "spring": ("load $P$ (bond stiffness × lattice spacing)", "displacement $u$ (lattice spacing)"),
    "fuse": ("current $I$ (threshold unit)", "voltage $V$ (threshold unit / bond conductance)"),
}


def draw_response(axes, breaks, model, failed):
    """Load against displacement, break by break, with its envelope and its peak."""
    displacement = breaks.load / breaks.stiffness
    peak = int(np.argmax(breaks.load))
    few = len(displacement) <= JOINED
    axes.plot(displacement, breaks.load, color="0.55", linewidth=0.4 if few else 0, marker="o",
              markersize=2.2 if few else 1.6, markeredgewidth=0, label="every break")
    axes.plot(*envelope(breaks.load, breaks.stiffness, failed), color="black", linewidth=1.1,
              label="envelope")
    axes.plot(displacement[peak], breaks.load[peak], "v", color=AFTER, markersize=7, markeredgecolor="black",
              markeredgewidth=0.6, label=f"peak {breaks.load[peak]:.4g}")
    axes.set_ylabel(LABELS[model][0])
    axes.set_xlabel(LABELS[model][1])
    show_up_to(axes, largest=displacement.max(), limit=TAIL * displacement[peak])
    axes.set_ylim(0, 1.08 * breaks.load[peak])
    axes.legend(frameon=False, loc="best")


def show_up_to(axes, largest, limit):
    """Ends the displacement axis at `limit`; says so where the response goes on beyond it."""
    axes.set_xlim(0, min(1.05 * largest, limit))
    if largest > limit:
        axes.annotate(f"to {largest:.3g}", xy=(1, 0.1), xytext=(-34, 0), xycoords="axes fraction",
                      textcoords="offset points", ha="right", va="center", fontsize="small",
                      arrowprops=dict(arrowstyle="->", linewidth=0.8))


def draw_broken_bonds(axes, network, breaks):
    """Broken bonds on the lattice, those up to and including the peak load and those after it."""
    segments = network.segments()
    peak = int(np.argmax(breaks.load))
    before, after = breaks.bond[:peak + 1], breaks.bond[peak + 1:]
    intact = np.ones(len(segments), dtype=bool)
    intact[breaks.bond] = False
    extent = np.ptp(segments.reshape(-1, 2), axis=0).max()
    bold = np.clip(120 / extent, 0.7, 2.5)  # points; about a third of a bond's length on paper
    for bonds, colour, width in ((intact, INTACT, 0.3 * bold), (before, BEFORE, bold), (after, AFTER, bold)):
        axes.add_collection(LineCollection(segments[bonds], colors=colour, linewidths=width,
                                           capstyle="round"))
    axes.margins(0.02)
    axes.autoscale_view()
    axes.set_aspect("equal")
    axes.set_xlabel("$x$ (lattice spacing)")
    axes.set_ylabel("$y$ (lattice spacing)")
    handles = [Line2D([], [], color=colour, linewidth=2) for colour in (BEFORE, AFTER, INTACT)]
    names = [f"broken up to the peak ({len(before)})", f"broken after it ({len(after)})", "intact"]
    axes.legend(handles, names, frameon=False, loc="lower center", bbox_to_anchor=(0.5, 1.0), ncol=3,
                columnspacing=1.2, handlelength=1.2, fontsize="medium", borderaxespad=0.2)


def draw_sample(run, s):
    """A figure of the s-th sample in the file."""
    breaks, network = run.breaks(s), run.network()
    if not len(breaks.bond):
        raise ValueError(f"{run.path}: no bond broke in sample {run.index[s]}")
    if network is None:
        raise ValueError(f"{run.path}: no /network (run with -record network)")
    if breaks.bond.min() < 0 or breaks.bond.max() >= len(network.bonds):
        raise ValueError(f"{run.path}: a bond number beyond the network's {len(network.bonds)} bonds")
    model = "fuse" if network.components == 1 else "spring"  # a network file may decide it, not an option
    figure = Figure(figsize=(10.5, 5), layout="constrained")
    left, right = figure.subplots(1, 2)
    draw_response(left, breaks, model, failed=run.options.get("-stop", "failure") == "failure")
    draw_broken_bonds(right, network, breaks)
    lattice = " ".join(filter(None, map(run.options.get, ("-lattice", "-lattice_size"))))
    left.set_title(f"{model}, {lattice}, sample {run.index[s]}", fontsize="medium")
    return figure
