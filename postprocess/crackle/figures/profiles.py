"""Figures of average damage profiles: at peak load, their Fourier magnitudes, collapse of what comes after."""
import numpy as np

from crackle.figures.style import inset, interval_text, side_by_side, size_label, size_style, thin
from crackle.statistics.damage_profiles import fourier_magnitudes, uncorrelated_magnitude
from crackle.study.analysis import mean_profile, of_model, profile_scaling, rescale_profile


def profile_peak(study):
    """Average damage profiles at peak load, each sample shifted by its centre of mass."""
    def panel(axes, model):
        for ensemble in of_model(study, model, 2, recorded=True):
            y, mean, error, _ = mean_profile(ensemble, 0)
            axes.errorbar(y / ensemble.size, mean, error, label=size_label(ensemble), elinewidth=0.6,
                          markersize=2 if ensemble.size > 40 else 3.2, **size_style(study, ensemble))
        axes.set_xlabel("$(y-y_\\mathrm{cm})/L$")
        axes.set_ylabel("$\\langle p(y)\\rangle$ at peak load")
        axes.set_ylim(bottom=0)
        axes.legend(loc="lower center", ncol=3)
    return side_by_side(panel, sharey=False)


def profile_fourier(study):
    """Magnitudes of the Fourier transforms of damage profiles, averaged.

    Above: damage up to the peak load; below: damage after it. Dotted: bonds broken independently, anywhere.
    """
    def panel(rows, model):
        for part, axes in enumerate(rows):
            for ensemble in of_model(study, model, 2, failed=part == 1, recorded=True):
                counts = ensemble.profiles[part]
                magnitude = fourier_magnitudes(counts)
                wave = np.arange(1, magnitude.shape[1] + 1)
                style = size_style(study, ensemble)
                axes.errorbar(wave, magnitude.mean(axis=0), magnitude.std(axis=0) / np.sqrt(len(magnitude)),
                              elinewidth=0.6, linewidth=0.8, label=size_label(ensemble),
                              **{**style, "markersize": 2.5})
                broken = counts.sum(axis=1)
                level = np.mean(uncorrelated_magnitude(broken[broken > 0]))
                axes.plot(wave[[0, -1]], [level, level], ":", linewidth=0.9, color=style["color"])
            axes.set_xscale("log")
            axes.set_yscale("log")
            axes.set_ylabel("$\\langle|\\hat p(q)|\\rangle/\\hat p(0)$, " + ("at peak load", "after it")[part])
        rows[1].set_xlabel("wave number $q$ (waves across the sample)")
        rows[0].legend(ncol=2, loc="best")
    return side_by_side(panel, rows=2, height=2.5, sharey=True)


def profile_collapse(study):
    """Collapse of the profiles of damage between peak load and failure, with fitted alpha."""
    def panel(axes, model):
        scaling = profile_scaling(study, model)
        small = inset(axes, [0.6, 0.56, 0.38, 0.41])
        for ensemble in of_model(study, model, 3, failed=True, recorded=True):
            curve = next((c for c in scaling.curves if c.size == ensemble.size), None)
            if curve is None:
                continue
            scaled = rescale_profile(curve, [scaling.localization.value])
            keep = thin(scaled.x, 30)
            axes.errorbar(scaled.x[keep], scaled.y[keep], scaled.error[keep], linestyle="none", elinewidth=0.6,
                          label=size_label(ensemble), **size_style(study, ensemble))
            small.plot(curve.x, curve.y, linewidth=0.8, color=size_style(study, ensemble)["color"])
        axes.set_yscale("log")
        axes.set_xlabel("$|y-y_\\mathrm{cm}|/L^{\\alpha}$")
        axes.set_ylabel("$\\langle\\Delta p(y)\\rangle/\\langle\\Delta p(0)\\rangle$")
        axes.text(0.03, 0.04, f"$\\alpha$ = {interval_text(scaling.localization)}\n"
                  f"quality S = {scaling.localization.misfit:.1f}  (with $\\alpha=1$: {scaling.linear_quality:.0f})\n"
                  f"$\\langle\\Delta p(0)\\rangle\\sim L^{{-x}}$, x = {interval_text(scaling.peak)}",
                  transform=axes.transAxes, fontsize=7, va="bottom")
        axes.legend(loc="lower left", bbox_to_anchor=(0.0, 0.22))
        small.set_yscale("log")
        small.set_xlabel("$|y-y_\\mathrm{cm}|$")
        small.set_ylabel("$\\langle\\Delta p\\rangle$")
    return side_by_side(panel)
