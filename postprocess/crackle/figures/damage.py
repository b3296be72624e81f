"""Figures of how many bonds break: scaling with size, distributions at peak load and at failure, last avalanche."""
import numpy as np
from scipy.stats import norm

from crackle.figures.style import (MODEL_COLOURS, NAMES, REFERENCE, inset, interval_text, new_figure, side_by_side,
                                   size_label, size_style, spread_probabilities)
from crackle.statistics.goodness import spread_integers
from crackle.study.analysis import LEAST_SAMPLES, normal_goodness, of_model, size_law
from crackle.study.ensembles import Missing


def cumulative(values):
    """Sorted values with their empirical probabilities (i - 1/2)/n."""
    ordered = np.sort(values)
    return ordered, (np.arange(len(ordered)) + 0.5) / len(ordered)


def reduced(values):
    """(values - mean) / standard deviation."""
    return (values - values.mean()) / values.std()


def draw_power_law(axes, study, model, key, label):
    """Mean against the number of bonds, with the fitted power law and its exponent."""
    law = size_law(study, model, key)
    ensembles = of_model(study, model, failed=key == "last_avalanche")
    for ensemble, x, mean, error in zip(ensembles, law.x, law.mean, law.error):
        axes.errorbar(x, mean, error, linestyle="none", label=size_label(ensemble), **size_style(study, ensemble))
    grid = np.geomspace(law.x.min(), law.x.max(), 100)
    fitted = f"$b$ = {interval_text(law.exponent)}"
    axes.plot(grid, law.law(grid, law.fit), **{**REFERENCE, "zorder": 1}, label=fitted)
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.set_xlabel("number of bonds $N_\\mathrm{el}$")
    axes.set_ylabel(label)
    axes.legend(loc="upper left")
    return law


def damage_scaling(study):
    """Broken bonds at peak load against the number of bonds; inset: the same as a fraction, against log N."""
    def panel(axes, model):
        law = draw_power_law(axes, study, model, "n_p", "$\\langle n_p\\rangle$")
        small = inset(axes, [0.6, 0.14, 0.38, 0.36])
        small.errorbar(law.x, law.mean / law.x, law.error / law.x, marker="o", markersize=2.5, linewidth=0.7,
                       color=MODEL_COLOURS[model])
        small.set_xscale("log")
        small.set_xlabel("$N_\\mathrm{el}$")
        small.set_ylabel("$\\langle n_p\\rangle/N_\\mathrm{el}$")
    return side_by_side(panel)


def damage_peak_cdf(study):
    """Cumulative distribution of the fraction of broken bonds at peak load."""
    def panel(axes, model):
        for ensemble in of_model(study, model, LEAST_SAMPLES):
            x, p = cumulative(spread_integers(ensemble.n_p) / ensemble.bonds)
            keep = spread_probabilities(p)
            axes.plot(x[keep], p[keep], label=size_label(ensemble), **size_style(study, ensemble))
        axes.set_xlabel("fraction of broken bonds $p_b$")
        axes.set_ylabel("$\\Pi_p(p_b,L)$")
        axes.set_xlim(left=0)
        axes.legend(loc="lower right")
    return side_by_side(panel)


def _collapsed(study, quantity, symbol):
    """Both models and all sizes in the reduced variable: cumulative on the left, on normal paper on the right."""
    figure, axes = new_figure(2)
    notes = []
    for model in ("spring", "fuse"):
        try:
            ensembles = of_model(study, model, LEAST_SAMPLES, failed=quantity != "n_p")
        except Missing as reason:
            notes.append(f"{NAMES[model]}: {reason}")
            continue
        for ensemble in ensembles:
            x, p = cumulative(reduced(spread_integers(getattr(ensemble, quantity))))
            keep = spread_probabilities(p)
            label = f"{NAMES[model]}, {size_label(ensemble)}"
            style = size_style(study, ensemble)
            axes[0, 0].plot(x[keep], p[keep], linestyle="none", label=label, **style)
            axes[0, 1].plot(x[keep], norm.ppf(p[keep]), linewidth=0.5, **style)
    if not axes[0, 0].lines:
        raise Missing("; ".join(notes))
    figure.notes += notes
    grid = np.linspace(-4, 4, 200)
    axes[0, 0].plot(grid, norm.cdf(grid), label="normal", **REFERENCE)
    axes[0, 1].plot(grid, grid, **REFERENCE)
    variable = f"$({symbol}-\\langle {symbol}\\rangle)/\\Delta_{{{symbol}}}$"
    for one, name in zip(axes[0], ("cumulative probability $\\Pi$", "$\\Phi^{-1}(\\Pi)$")):
        one.set_xlabel(variable)
        one.set_ylabel(name)
        one.set_xlim(-4, 4)
    axes[0, 1].set_ylim(-4, 4)
    axes[0, 0].legend(loc="upper left", fontsize=5.5)
    axes[0, 1].text(0.03, 0.96, normality_text(study, quantity), transform=axes[0, 1].transAxes, va="top", fontsize=6,
                    linespacing=1.3)
    return figure


def normality_text(study, quantity):
    """Anderson-Darling distances to a normal distribution with their p-values, a line a size."""
    lines = ["Anderson-Darling $A^2$ (p)"]
    for model in study.models:
        for ensemble in study.of(model):
            try:
                test = normal_goodness(ensemble, quantity)
            except Missing:
                continue
            p = "<0.01" if test.ad_p < 0.01 else f"{test.ad_p:.2f}"
            lines.append(f"{NAMES[model]} {ensemble.size}: {test.ad:.{0 if test.ad >= 10 else 2}f} ({p})")
    return "\n".join(lines)


def damage_peak_collapse(study):
    """Damage at peak load in the reduced variable, spring and fuse together, and on normal paper."""
    return _collapsed(study, "n_p", "n_p")


def damage_failure_collapse(study):
    """The same at failure, where the spring model's must not be normal."""
    return _collapsed(study, "n_f", "n_f")


def last_avalanche_scaling(study):
    """Mean size of the last avalanche, n_f - n_p, against the number of bonds."""
    def panel(axes, model):
        draw_power_law(axes, study, model, "last_avalanche", "$\\langle n_f-n_p\\rangle$")
    return side_by_side(panel)


def last_avalanche_distribution(study):
    """Collapsed cumulative distribution of the last avalanche's size; inset: on normal paper."""
    def panel(axes, model):
        small = inset(axes, [0.6, 0.14, 0.38, 0.42])
        for ensemble in of_model(study, model, LEAST_SAMPLES, failed=True):
            x, p = cumulative(reduced(spread_integers(ensemble.last_avalanche)))
            keep = spread_probabilities(p)
            style = size_style(study, ensemble)
            axes.plot(x[keep], p[keep], linestyle="none", label=size_label(ensemble), **style)
            small.plot(x[keep], norm.ppf(p[keep]), linewidth=0.4, **{**style, "markersize": 1.8})
        grid = np.linspace(-4, 4, 200)
        axes.plot(grid, norm.cdf(grid), label="normal", **REFERENCE)
        small.plot(grid, grid, **REFERENCE)
        for one in (axes, small):
            one.set_xlim(-3, 5)
        small.set_ylim(-4, 4)
        small.set_ylabel("$\\Phi^{-1}$")
        axes.set_xlabel("$(s_m-\\langle s_m\\rangle)/\\Delta_{s_m}$, $s_m=n_f-n_p$")
        axes.set_ylabel("cumulative probability")
        axes.legend(loc="upper left")
    return side_by_side(panel)
