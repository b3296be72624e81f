"""Figures of avalanches before the last: distributions, their collapse, and how firmly tau is known."""
import numpy as np

from crackle.figures.style import REFERENCE, interval_text, side_by_side, size_label, size_style
from crackle.study.analysis import COLLAPSE_LEAST, avalanche_density, avalanche_scaling, of_model
from crackle.study.ensembles import Missing


def avalanches(study):
    """Avalanche sizes without the last, in logarithmic bins, all sizes."""
    def panel(axes, model):
        reasons = []
        for ensemble in of_model(study, model, 1, recorded=True):
            try:
                s, density, error = avalanche_density(ensemble)
            except Missing as reason:
                reasons.append(str(reason))
                continue
            axes.errorbar(s, density, error, linestyle="none", elinewidth=0.6, label=size_label(ensemble),
                          **size_style(study, ensemble))
        if not axes.containers:
            raise Missing("; ".join(reasons))
        _reference_slope(axes, study, model)
        axes.set_xscale("log")
        axes.set_yscale("log")
        axes.set_xlabel("avalanche size $s$ (bonds)")
        axes.set_ylabel("$P(s)$")
        axes.legend(loc="lower left")
    return side_by_side(panel, sharey=True)


def _reference_slope(axes, study, model):
    """The fitted s^-tau exp(-s/s_0) of the largest size; without enough avalanches, nothing."""
    try:
        scaling = avalanche_scaling(study, model)
    except Missing:
        return
    s, density, _ = avalanche_density(scaling.largest)
    keep = s >= scaling.s_min
    shape = s ** -scaling.tau.value * np.exp(-s / scaling.cutoff)
    scale = np.exp(np.mean(np.log(density[keep] / shape[keep])))
    axes.plot(s[keep], scale * shape[keep], **REFERENCE,
              label=f"$s^{{-\\tau}}e^{{-s/s_0}}$, $L={scaling.largest.size}$\n$\\tau$ = {interval_text(scaling.tau)}")


def avalanche_collapse(study):
    """Collapse of the avalanche distributions with the tau and D that make it best."""
    def panel(axes, model):
        scaling = avalanche_scaling(study, model)
        if not scaling.collapse:
            raise Missing("2 sizes with 1000 avalanches are needed")
        tau, dimension = scaling.collapse["tau"], scaling.collapse["dimension"]
        for ensemble in of_model(study, model, 2, recorded=True):
            curve = next((c for c in scaling.curves if c.size == ensemble.bonds), None)
            if curve is None:
                continue
            x, y = np.exp(curve.x - dimension.value / 2 * np.log(curve.size)), curve.y
            y = np.exp(y + tau.value * dimension.value / 2 * np.log(curve.size))
            axes.errorbar(x, y, y * curve.error, linestyle="none", elinewidth=0.6, label=size_label(ensemble),
                          **size_style(study, ensemble))
        grid = np.array([min(line.get_xdata().min() for line in axes.lines), 0.3])
        axes.plot(grid, 0.6 * y[0] * (grid / x[0]) ** -tau.value, **REFERENCE, label="slope $-\\tau$")
        axes.set_xscale("log")
        axes.set_yscale("log")
        axes.set_xlabel("$s/N_\\mathrm{el}^{D/2}$")
        axes.set_ylabel("$P(s)\\,N_\\mathrm{el}^{\\tau D/2}$")
        axes.text(0.97, 0.97, f"$\\tau$ = {interval_text(tau)}\n$D$ = {interval_text(dimension)}\n"
                  f"quality S = {tau.misfit:.1f}, $s\\geq{COLLAPSE_LEAST}$", transform=axes.transAxes, ha="right",
                  va="top", fontsize=7)
        axes.legend(loc="lower left")
    return side_by_side(panel)


def avalanche_exponent(study):
    """tau by maximum likelihood against the smallest avalanche that is counted: how firm the exponent is."""
    def panel(axes, model):
        scaling = avalanche_scaling(study, model)
        for ensemble in of_model(study, model, 2, recorded=True):
            fits = scaling.fits.get(ensemble.size)
            if fits is None:
                continue
            axes.plot([f.s_min for f in fits], [f.tau for f in fits], label=size_label(ensemble),
                      **size_style(study, ensemble))
        quoted = scaling.tau
        axes.errorbar(scaling.s_min, quoted.value, [[quoted.value - quoted.low], [quoted.high - quoted.value]],
                      color="black", marker="s", markersize=6, markerfacecolor="none", capsize=3, zorder=9,
                      label=f"quoted: {interval_text(quoted)}")
        axes.set_xlabel("smallest avalanche in the fit, $s_\\mathrm{min}$")
        axes.set_ylabel("$\\tau$ (maximum likelihood)")
        axes.set_ylim(0, 4)
        axes.legend(loc="upper right", ncol=3, columnspacing=1)
    return side_by_side(panel, sharey=True)
