"""Figures of strength: densities and distributions in the lognormal variable, fits of three families, size effect."""
import numpy as np
from scipy.stats import norm

from crackle.figures.damage import cumulative, reduced
from crackle.figures.style import (MODEL_COLOURS, NAMES, REFERENCE, inset, interval_text, new_figure, size_label,
                                   size_style, spread_probabilities)
from crackle.statistics.strength_fits import reduced_log_survival
from crackle.study.analysis import LEAST_SAMPLES, of_model, size_law, weakest_link
from crackle.study.ensembles import MODELS, Missing

LEAST_FOR_DENSITY = 200  # samples; a histogram of fewer says little


def _each_ensemble(study, samples, figure):
    """All ensembles with so many samples; what is left out goes into the figure's notes."""
    found = []
    for model in MODELS:
        try:
            kept = of_model(study, model, samples)
            found += kept
            left_out = [str(e.size) for e in study.of(model) if e not in kept]
            if left_out:
                figure.notes.append(f"{NAMES[model]}: L = {', '.join(left_out)} left out, fewer than {samples} samples")
        except Missing as reason:
            figure.notes.append(f"{NAMES[model]}: {reason}")
    if not found:
        raise Missing("; ".join(figure.notes))
    return found


def lognormal_variable(ensemble):
    """(ln sigma_f - eta) / zeta."""
    return reduced(np.log(ensemble.strength))


def strength_density(study):
    """Densities of strength in the standard lognormal variable, all sizes, both models."""
    figure, axes = new_figure(1, width=1.3 * 3.5, height=3.3)
    one = axes[0, 0]
    for ensemble in _each_ensemble(study, LEAST_FOR_DENSITY, figure):
        values = lognormal_variable(ensemble)
        bins = np.linspace(-4, 4, int(np.clip(len(values) ** (1 / 3) * 1.3, 9, 33)))
        density, edges = np.histogram(values, bins, density=True)
        keep = density > 0
        centre = 0.5 * (edges[1:] + edges[:-1])
        error = np.sqrt(density / (len(values) * np.diff(edges)))
        one.errorbar(centre[keep], density[keep], error[keep], linestyle="none", elinewidth=0.5,
                     label=f"{NAMES[ensemble.model]}, {size_label(ensemble)}", **size_style(study, ensemble))
    grid = np.linspace(-4, 4, 200)
    one.plot(grid, norm.pdf(grid), label="lognormal", **REFERENCE)
    one.set_xlim(-4.2, 4.2)
    one.set_ylim(bottom=0)
    one.set_xlabel("standard lognormal variable $\\bar\\xi=(\\ln\\sigma_f-\\eta)/\\zeta$")
    one.set_ylabel("density")
    one.legend(fontsize=6)
    return figure


def strength_cdf(study):
    """Cumulative distributions of strength in the standard lognormal variable, all sizes, both models."""
    figure, axes = new_figure(1, width=1.3 * 3.5, height=3.3)
    one = axes[0, 0]
    for ensemble in _each_ensemble(study, LEAST_SAMPLES, figure):
        x, p = cumulative(lognormal_variable(ensemble))
        keep = spread_probabilities(p)
        one.plot(x[keep], p[keep], linestyle="none", label=f"{NAMES[ensemble.model]}, {size_label(ensemble)}",
                 **size_style(study, ensemble))
    grid = np.linspace(-4, 4, 200)
    one.plot(grid, norm.cdf(grid), label="lognormal", **REFERENCE)
    one.set_xlim(-4.2, 4.2)
    one.set_xlabel("standard lognormal variable $\\bar\\xi=(\\ln\\sigma_f-\\eta)/\\zeta$")
    one.set_ylabel("$P(\\sigma\\leq\\sigma_f)$")
    one.legend(fontsize=6)
    return figure


def _weakest_link_panel(axes, study, model, gumbel):
    """A against z: one straight line for all sizes, if the law held."""
    law = weakest_link(study, model, gumbel)
    for ensemble in of_model(study, model, LEAST_SAMPLES):
        sigma, p = cumulative(ensemble.strength)
        keep = spread_probabilities(p)
        axes.plot(law.z(sigma[keep]), reduced_log_survival(p[keep], ensemble.size), linewidth=0.5,
                  label=size_label(ensemble), **{**size_style(study, ensemble), "markersize": 2.2})
    low, high = axes.get_xlim()
    axes.plot([low, high], law.line(np.array([low, high])), **REFERENCE)
    axes.set_xlim(low, high)
    if gumbel:
        axes.set_xlabel(f"$(\\sigma_0/\\sigma_f)^\\delta$,  $\\delta={law.delta:.2f}$, $\\sigma_0={law.unit:.3f}$")
    else:
        axes.set_xlabel(f"$\\ln(\\sigma_0/\\sigma_f)$,  $\\sigma_0={law.unit:.3f}$;  $m={law.k:.2f}$")


def _lognormal_panel(axes, study, model):
    for ensemble in of_model(study, model, LEAST_SAMPLES):
        x, p = cumulative(lognormal_variable(ensemble))
        keep = spread_probabilities(p)
        axes.plot(x[keep], norm.ppf(p[keep]), linewidth=0.5, **{**size_style(study, ensemble), "markersize": 2.2})
    axes.plot([-4.5, 4.5], [-4.5, 4.5], **REFERENCE)
    axes.set_xlabel("$\\bar\\xi=(\\ln\\sigma_f-\\eta)/\\zeta$")
    axes.set_xlim(-4.5, 4.5)
    axes.set_ylim(-4.5, 4.5)


def strength_fits(study):
    """Modified Gumbel, Weibull and lognormal fits: each a straight line, common to all sizes, if it held."""
    available, notes = [], []
    for model in MODELS:
        try:
            of_model(study, model, LEAST_SAMPLES)
            available.append(model)
        except Missing as reason:
            notes.append(f"{NAMES[model]}: {reason}")
    if not available:
        raise Missing("; ".join(notes))
    figure, axes = new_figure(3, len(available), width=2.5, height=2.5)
    figure.notes += notes
    for row, model in zip(axes, available):
        _weakest_link_panel(row[0], study, model, gumbel=True)
        _weakest_link_panel(row[1], study, model, gumbel=False)
        _lognormal_panel(row[2], study, model)
        row[0].set_ylabel(f"{NAMES[model]}\n$A=-\\ln[-\\ln(1-P)/L^2]$")
        row[2].set_ylabel("$\\Phi^{-1}(P)$")
        row[0].legend(fontsize=6)
    for one, name in zip(axes[0], ("modified Gumbel", "Weibull", "lognormal")):
        one.set_title(name)
    return figure


def size_effect(study):
    """Mean peak load and mean strength against L: C0 L^alpha + C1, the logarithmic law, and Weibull's power law."""
    figure, (axes,) = new_figure(2)
    small = inset(axes[0], [0.57, 0.12, 0.41, 0.36])
    drawn = []
    for model in MODELS:
        try:
            peak, strength = size_law(study, model, "peak_load"), size_law(study, model, "strength")
        except Missing as reason:
            figure.notes.append(f"{NAMES[model]}: {reason}")
            continue
        drawn.append(model)
        style = dict(color=MODEL_COLOURS[model], marker="os"[MODELS.index(model)])
        c0, c1 = peak.fit.coefficients
        _points_and_fit(axes[0], peak, style, f"{NAMES[model]}: $\\alpha$ = {interval_text(peak.exponent)}\n"
                        f"    $C_0={c0:.3f}$, $C_1={c1:.2f}$")
        _points_and_fit(axes[1], strength, style, f"{NAMES[model]}: $\\psi$ = {interval_text(strength.exponent)}")
        _weibull_inset(small, study, model, style)
    if not drawn:
        raise Missing("; ".join(figure.notes))
    axes[0].set_yscale("log")
    low, high = axes[0].get_ylim()
    axes[0].set_ylim(low / 10, high * 4)  # room for the inset below, the legend above
    small.set_yscale("log")
    for axis_format in (small.yaxis.set_major_formatter, small.yaxis.set_minor_formatter):
        axis_format(lambda value, _: f"{value:.2g}")
    small.set_ylabel("$\\mu_f$")
    for one in (*axes, small):
        one.set_xscale("log", base=2)
        one.xaxis.set_major_formatter(lambda value, _: f"{value:g}")
        one.set_xlabel("$L$")
    small.text(0.5, 0.97, "$L^{-2/m}$?", transform=small.transAxes, fontsize=6.5, va="top")
    axes[0].set_ylabel("mean peak load $\\bar F_\\mathrm{peak}$")
    axes[1].set_ylabel("mean strength $\\mu_f=\\bar F_\\mathrm{peak}/L$")
    axes[0].legend(loc="upper left", title="$C_0L^\\alpha+C_1$", title_fontsize=7.5)
    axes[1].legend(title="$\\mu_f^\\ast(\\ln L)^{-\\psi}+c/L$", title_fontsize=7.5)
    return figure


def _points_and_fit(axes, law, style, label):
    axes.errorbar(law.x, law.mean, law.error, linestyle="none", **style)
    grid = np.geomspace(law.x[law.used].min(), law.x.max(), 100)
    axes.plot(grid, law.law(grid, law.fit), color=style["color"], linewidth=1, label=label)


def _weibull_inset(small, study, model, style):
    law = size_law(study, model, "weibull")
    small.plot(law.x, law.mean, linestyle="none", markersize=2.5, **style)
    small.plot(law.x, law.law(law.x, law.fit), color=style["color"], linewidth=0.7)
