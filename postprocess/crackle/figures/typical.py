"""Figures of one sample of each model: response, snapshots of damage, damage profiles segment by segment."""
import numpy as np
from matplotlib.collections import LineCollection
from matplotlib.ticker import MaxNLocator

from crackle.figures.sample import AFTER, BEFORE, draw_response
from crackle.figures.style import NAMES, new_figure, side_by_side
from crackle.statistics.damage_profiles import segment_counts
from crackle.study.ensembles import Missing

# The paper's nine pictures (5000 ... 16500 of 13864 at the peak and 16695 at failure), as shares of the way to the
# peak and from there to failure.
SHARES_TO_PEAK = (0.361, 0.721, 0.866, 0.938)
SHARES_TO_FAILURE = (0.048, 0.401, 0.578, 0.754, 0.931)
SEGMENTS = 6


def largest_recorded(study, model):
    """The model's largest size with breaks: the sample that is drawn is its most typical."""
    found = [e for e in study.of(model) if e.recorded and e.run.n_f[e.typical()] > 0]
    if not found:
        raise Missing(f"no {model} run" + (" with -record breaks" if study.of(model) else ""))
    return found[-1]


def _sample_of(study, model):
    ensemble = largest_recorded(study, model)
    s = ensemble.typical()
    return ensemble, ensemble.run.breaks(s), int(ensemble.run.n_p[s]), int(ensemble.run.index[s])


def response(study):
    """Load against displacement of a typical sample, every break, with the envelope."""
    def panel(axes, model):
        ensemble, breaks, _, index = _sample_of(study, model)
        draw_response(axes, breaks, model, ensemble.failed)
        axes.set_title(f", $L={ensemble.size}$, sample {index}")
    return side_by_side(panel)


def snapshots_of(study, model):
    """Nine pictures of the broken bonds as damage grows; before the peak blue, after it orange."""
    ensemble, breaks, peak, index = _sample_of(study, model)
    if not ensemble.failed:
        raise Missing(f"{ensemble.run.path}: not broken to failure")
    total = len(breaks.bond)
    numbers = [round(share * peak) for share in SHARES_TO_PEAK]
    numbers += [peak + round(share * (total - peak)) for share in SHARES_TO_FAILURE]
    segments = ensemble.network.segments()
    figure, axes = new_figure(3, 3, width=2.3, height=2.4)
    extent = np.ptp(segments.reshape(-1, 2), axis=0).max()
    width = np.clip(72 * 2.0 / extent, 0.35, 1.5)
    for place, (one, number) in enumerate(zip(axes.flat, numbers)):
        for bonds, colour in ((breaks.bond[:min(number, peak)], BEFORE), (breaks.bond[peak:max(number, peak)], AFTER)):
            one.add_collection(LineCollection(segments[bonds], colors=colour, linewidths=width))
        one.set_xlim(segments[..., 0].min(), segments[..., 0].max())
        one.set_ylim(segments[..., 1].min() - 0.5, segments[..., 1].max() + 0.5)
        one.set_aspect("equal")
        one.set_xticks([])
        one.set_yticks([])
        one.set_title(f"({place + 1})  $n_b={number}$", fontsize=8, pad=3)
    figure.suptitle(f"{NAMES[model]}, $L={ensemble.size}$, sample {index}: $n_p={peak}$, $n_f={total}$", fontsize=9)
    return figure


def snapshots_spring(study):
    """Nine snapshots of damage, spring network."""
    return snapshots_of(study, "spring")


def snapshots_fuse(study):
    """Nine snapshots of damage, fuse network."""
    return snapshots_of(study, "fuse")


def _segment_panels(study, side):
    """The profiles of six segments on one side of the peak, one above the other."""
    def panel(axes, model):
        ensemble, breaks, peak, _ = _sample_of(study, model)
        if side == 1 and (not ensemble.failed or len(breaks.bond) - peak < SEGMENTS):
            raise Missing(f"{ensemble.run.path}: no {SEGMENTS} breaks after the peak load")
        if peak < SEGMENTS:
            raise Missing(f"{ensemble.run.path}: no {SEGMENTS} breaks up to the peak load")
        counts = segment_counts(breaks.bond, peak, ensemble.section, ensemble.sections, SEGMENTS)[side]
        y = np.arange(ensemble.sections)
        top = 1.15 * counts.max() / ensemble.bonds_per_section
        for number, (one, row) in enumerate(zip(axes, counts)):
            one.fill_between(y, row / ensemble.bonds_per_section, step="mid", linewidth=0,
                             color=(BEFORE, AFTER)[side])
            one.set_xlim(0, ensemble.sections - 1)
            one.set_ylim(0, top)
            one.text(0.98, 0.78, f"{number + 1}: {row.sum()} breaks", transform=one.transAxes, ha="right",
                     fontsize=7)
            if number < SEGMENTS - 1:
                one.set_xticklabels([])
        axes[-1].set_xlabel(f"row section $y$   ($L={ensemble.size}$)")
        axes[SEGMENTS // 2].set_ylabel("$p(y)=n_b(y)/(3L+1)$ within the segment")
        axes[SEGMENTS // 2].yaxis.set_label_coords(-0.16, 1.0)
    figure = side_by_side(panel, rows=SEGMENTS, height=0.95)
    for one in figure.axes:
        one.yaxis.set_major_locator(MaxNLocator(2))
    return figure


def segments_before(study):
    """Damage profiles of six equal segments (of equally many breaks) before the peak load."""
    return _segment_panels(study, 0)


def segments_after(study):
    """Damage profiles of six equal segments after the peak load."""
    return _segment_panels(study, 1)
