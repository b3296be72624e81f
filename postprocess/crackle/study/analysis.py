"""What a study says about the paper's claims: every fit, made once and kept, for figures and tables alike.

Every function takes the study (or an ensemble) and returns the same object however often it is called. What can't be
made from the runs there are raises Missing with the reason.
"""
from dataclasses import dataclass
from functools import cache

import numpy as np

from crackle.statistics.avalanches import (binned_density, choose_s_min, fit_avalanches, fit_avalanches_resampled,
                                           log_bins)
from crackle.statistics.bootstrap import Estimate, estimate
from crackle.statistics.collapse import Curve, best_collapse, quality
from crackle.statistics.damage_profiles import average_profile, centred
from crackle.statistics.goodness import compare, goodness, spread_integers
from crackle.statistics.scaling import LOGARITHMIC_LAW, POWER_LAW, SHIFTED_POWER_LAW, Fit, Law, fit_resampled
from crackle.statistics.strength_fits import FAMILIES, fit_weakest_link
from crackle.study.ensembles import Missing

LEAST_SIZE = 16           # corrections to scaling are strongest below (the paper's choice)
LEAST_SAMPLES = 20        # for a distribution, and for a size in a fit where others are enough
COLLAPSE_LEAST = 5        # avalanches below, a few integers apart, are too coarse to interpolate between
COLLAPSE_RESAMPLES = 100  # a collapse is a search, not a formula
LEAST_IN_BIN = 10         # avalanches in a bin that counts in a collapse


@dataclass
class SizeLaw:
    """A mean against size: what was fitted, and to what."""
    law: Law
    fit: Fit
    exponent: Estimate
    x: np.ndarray     # all sizes, in the law's variable
    mean: np.ndarray
    error: np.ndarray
    used: np.ndarray  # bool: sizes in the fit


SIZE_LAWS = {  # key to law, abscissa and ordinate of an ensemble, whether failure must have been reached
    "n_p": (POWER_LAW, lambda e: e.bonds, lambda e: e.n_p, False),
    "last_avalanche": (POWER_LAW, lambda e: e.bonds, lambda e: e.last_avalanche, True),
    "peak_load": (SHIFTED_POWER_LAW, lambda e: e.size, lambda e: e.peak_load, False),
    "strength": (LOGARITHMIC_LAW, lambda e: e.size, lambda e: e.strength, False),
    "weibull": (POWER_LAW, lambda e: e.size, lambda e: e.strength, False),
}


def of_model(study, model, samples=2, failed=False, recorded=False):
    """The model's ensembles with at least so many samples (and broken to failure, and with /breaks)."""
    found = [e for e in study.of(model)
             if len(e) >= samples and (e.failed or not failed) and (e.recorded or not recorded)]
    if not study.of(model):
        raise Missing(f"no {model} run")
    if not found:
        needs = [f"{samples} samples"] + ["-stop failure"] * failed + ["-record breaks"] * recorded
        raise Missing(f"no {model} run with " + ", ".join(needs))
    return found


def scaling_sizes(ensembles, needed):
    """Those of LEAST_SIZE and LEAST_SAMPLES and more if they are enough, else all; Missing if all are too few."""
    if len(ensembles) < needed:
        raise Missing(f"{needed} sizes are needed, {len(ensembles)} there")
    chosen = [e for e in ensembles if e.size >= LEAST_SIZE and len(e) >= LEAST_SAMPLES]
    return chosen if len(chosen) >= needed else ensembles


@cache
def size_law(study, model, key):
    """The SizeLaw of a key of SIZE_LAWS."""
    law, abscissa, values, failed = SIZE_LAWS[key]
    ensembles = of_model(study, model, failed=failed)
    used = scaling_sizes(ensembles, law.coefficients + 1)
    x = np.array([abscissa(e) for e in ensembles], dtype=float)
    mean = np.array([values(e).mean() for e in ensembles])
    resampled = np.stack([e.resampled_mean(values(e)) for e in ensembles], axis=1)
    chosen = np.array([e in used for e in ensembles])
    try:
        fit, exponent = fit_resampled(law, x[chosen], mean[chosen], resampled[:, chosen])
    except ValueError as error:
        raise Missing(str(error)) from error
    return SizeLaw(law, fit, exponent, x, mean, resampled.std(axis=0, ddof=1), chosen)


@cache
def mean_profile(ensemble, part):
    """Average centred profile p(y): y from the middle, mean, standard error, resamples [R, sections].

    part: 0, damage up to the peak load; 1, after it.
    """
    if part == 1 and not ensemble.failed:
        raise Missing(f"{ensemble.run.path}: not broken to failure")
    counts = ensemble.profiles[part]
    shifted = centred(counts[counts.sum(axis=1) > 0]) / ensemble.bonds_per_section
    if len(shifted) < 2:
        raise Missing("2 samples are needed")
    mean = average_profile(shifted, np.ones((1, len(shifted))))[0]
    weights = ensemble.weights[:COLLAPSE_RESAMPLES, counts.sum(axis=1) > 0].astype(float)
    resampled = average_profile(shifted, weights)
    y = np.arange(len(mean)) - (len(mean) - 1) / 2
    return y, mean, resampled.std(axis=0, ddof=1), resampled


def _folded(profile):
    """The mean of both halves, from the middle outwards; the last axis is y."""
    both = (profile + profile[..., ::-1]) / 2
    return both[..., profile.shape[-1] // 2:]


def _profile_curves(ensembles):
    """Folded Delta p curves, and those of every resample: list of Curve, list of lists."""
    curves, resampled = [], []
    for e in ensembles:
        y, mean, _, samples = mean_profile(e, 1)
        folded, rows = _folded(mean), _folded(samples)
        error = rows.std(axis=0, ddof=1)
        keep = np.isfinite(folded) & np.isfinite(error) & (error > 0) & (folded > 0)
        distance = y[len(y) // 2:][keep]
        curves.append(Curve(e.size, distance, folded[keep], error[keep]))
        resampled.append([Curve(e.size, distance, row[keep], error[keep]) for row in rows])
    return curves, list(zip(*resampled))


def rescale_profile(curve, exponents):
    """Delta p / Delta p(0) against |y - L/2| / L^alpha."""
    scale = 1 / curve.y[0]
    return Curve(curve.size, curve.x / curve.size ** exponents[0], scale * curve.y, scale * curve.error)


@dataclass
class ProfileScaling:
    localization: Estimate  # alpha of xi ~ L^alpha; misfit: the collapse's quality
    peak: Estimate          # x of Delta p(0) ~ L^-x
    linear_quality: float   # with alpha = 1
    curves: list            # of Curve


@cache
def profile_scaling(study, model):
    """How the damage between peak load and failure scales with L."""
    curves, resampled = _profile_curves(scaling_sizes(of_model(study, model, 3, failed=True, recorded=True), 2))
    if min(len(curve.x) for curve in curves) < 2:
        raise Missing("too few samples with damage after the peak load")
    best = best_collapse(curves, rescale_profile, [0.7], [0.2])
    alphas = [best_collapse(rows, rescale_profile, best.exponents, [0.05], searches=1).exponents[0] for rows in resampled]
    heights = np.array([[curve.y[0] for curve in rows] for rows in resampled])
    fit, exponent = fit_resampled(POWER_LAW, [c.size for c in curves], [c.y[0] for c in curves], heights)
    peak = Estimate(-fit.exponent, -exponent.high, -exponent.low, fit.misfit, fit.p_value)
    linear = quality([rescale_profile(curve, [1.0]) for curve in curves])
    return ProfileScaling(estimate(best.exponents[0], alphas, best.quality), peak, linear, curves)


def _avalanche_curve(ensemble):
    """ln P against ln s in geometric bins, and every resample's ln P."""
    counts = np.asarray(ensemble.avalanche_counts.sum(axis=0)).ravel()
    edges = log_bins(len(counts) - 1)
    centre, density = binned_density(counts, edges)
    in_bin = np.add.reduceat(counts, edges[:-1])
    rows = binned_density(ensemble.resampled_mean(ensemble.avalanche_counts)[:COLLAPSE_RESAMPLES], edges)[1]
    keep = in_bin >= LEAST_IN_BIN
    with np.errstate(divide="ignore"):
        logs = np.log(rows[:, keep])
    error = np.std(np.where(np.isfinite(logs), logs, np.log(density[keep])), axis=0, ddof=1)
    return Curve(ensemble.bonds, np.log(centre[keep]), np.log(density[keep]), np.maximum(error, 1e-9)), logs


@cache
def avalanche_density(ensemble):
    """Log-binned P(s) of all avalanches but the last: s, P, standard error of P."""
    if ensemble.avalanche_counts.sum() < LEAST_IN_BIN:
        raise Missing(f"{ensemble.model}, L = {ensemble.size}: fewer than {LEAST_IN_BIN} avalanches")
    curve, _ = _avalanche_curve(ensemble)
    if not len(curve.x):
        raise Missing(f"{ensemble.model}, L = {ensemble.size}: no bin with {LEAST_IN_BIN} avalanches")
    density = np.exp(curve.y)
    return np.exp(curve.x), density, density * curve.error


def rescale_avalanches(curve, exponents):
    """ln(s^tau P) against ln(s / N^(D/2))."""
    tau, dimension = exponents
    return Curve(curve.size, curve.x - dimension / 2 * np.log(curve.size), curve.y + tau * curve.x, curve.error)


@dataclass
class AvalancheScaling:
    largest: object      # ensemble whose tau is quoted
    tau: Estimate        # maximum likelihood at that size; misfit: sqrt(n) D
    cutoff: float        # its s_0
    fits: dict           # size to the AvalancheFits at every s_min tried
    s_min: int
    joint: dict          # all sizes with one tau and D, maximum likelihood: Estimates
    collapse: dict       # the same from the best collapse
    curves: list


@cache
def tau_at_size(ensemble):
    """The maximum-likelihood fit of one ensemble: the quoted fit, all fits by s_min."""
    counts = np.asarray(ensemble.avalanche_counts.sum(axis=0)).ravel()
    try:
        return choose_s_min([counts], [ensemble.bonds])
    except ValueError as error:
        raise Missing(str(error)) from error


def _joint_fit(ensembles, s_min):
    counts = [np.asarray(e.avalanche_counts.sum(axis=0)).ravel() for e in ensembles]
    bonds = [e.bonds for e in ensembles]
    fit = fit_avalanches(counts, bonds, s_min)
    rows = [len(e) * e.resampled_mean(e.avalanche_counts)[:COLLAPSE_RESAMPLES] for e in ensembles]
    found = fit_avalanches_resampled(rows, bonds, fit)
    return {name: estimate(value, found[:, i], fit.score)
            for i, (name, value) in enumerate((("tau", fit.tau), ("dimension", fit.dimension)))}


def _avalanche_collapse(ensembles):
    curves, logs = zip(*[_avalanche_curve(e) for e in ensembles])
    cut = [curve.x >= np.log(COLLAPSE_LEAST) for curve in curves]
    curves = [Curve(c.size, c.x[k], c.y[k], c.error[k]) for c, k in zip(curves, cut)]
    if min(len(curve.x) for curve in curves) < 3:
        raise Missing("too few avalanches for a collapse")
    best = best_collapse(curves, rescale_avalanches, [2.5, 1.1], [0.2, 0.2])
    found = []
    for rows in zip(*[log[:, k] for log, k in zip(logs, cut)]):
        again = [Curve(c.size, c.x[np.isfinite(y)], y[np.isfinite(y)], c.error[np.isfinite(y)])
                 for c, y in zip(curves, rows)]
        found.append(best_collapse(again, rescale_avalanches, best.exponents, [0.1, 0.1], 1).exponents)
    found = np.array(found)
    return {name: estimate(best.exponents[i], found[:, i], best.quality)
            for i, name in enumerate(("tau", "dimension"))}, curves


@cache
def avalanche_scaling(study, model):
    """tau, D and the cutoff of the avalanche distribution, by every way there is."""
    ensembles = of_model(study, model, recorded=True)
    rich = [e for e in ensembles if e.avalanche_counts.sum() >= 1000]
    if not rich:
        raise Missing(f"no {model} run with 1000 avalanches")
    largest = ([e for e in rich if len(e) >= LEAST_SAMPLES] or rich)[-1]
    quoted, _ = tau_at_size(largest)
    rows = [largest.resampled_mean(largest.avalanche_counts)]
    found = fit_avalanches_resampled(rows, [largest.bonds], quoted)
    result = AvalancheScaling(largest, estimate(quoted.tau, found[:, 0], quoted.score), quoted.amplitude, {},
                              quoted.s_min, {}, {}, [])
    result.fits = {e.size: tau_at_size(e)[1] for e in rich}
    large = [e for e in rich if e.size >= LEAST_SIZE and len(e) >= LEAST_SAMPLES]
    if len(large) >= 2:
        result.joint = _joint_fit(large, quoted.s_min)
        result.collapse, result.curves = _avalanche_collapse(large)
    return result


@cache
def strength_goodness(ensemble, family):
    """Fitted, Goodness of the strengths of one ensemble."""
    _enough(ensemble)
    return FAMILIES[family](ensemble.strength), goodness(ensemble.strength, FAMILIES[family])


@cache
def lognormal_parameters(ensemble):
    """eta and zeta, mean and standard deviation of ln sigma_f, with their intervals."""
    _enough(ensemble)
    log = np.log(ensemble.strength)
    log_mean = log.mean()
    mean, square = ensemble.resampled_mean(np.stack([log - log_mean, (log - log_mean) ** 2], axis=1)).T
    return {"eta": estimate(log_mean, mean + log_mean), "zeta": estimate(log.std(), np.sqrt(square - mean ** 2))}


@cache
def strength_comparison(ensemble, first, second):
    """Vuong's test between two families."""
    _enough(ensemble)
    sigma = ensemble.strength
    return compare(sigma, FAMILIES[first](sigma), FAMILIES[second](sigma))


@cache
def weakest_link(study, model, gumbel):
    """One modified Gumbel (or Weibull) law for all sizes of a model."""
    ensembles = of_model(study, model, LEAST_SAMPLES)
    return fit_weakest_link([e.strength for e in ensembles], [e.size for e in ensembles], gumbel)


@cache
def normal_goodness(ensemble, quantity):
    """Goodness of a normal distribution for n_p, n_f or last_avalanche, spread over the integers' steps."""
    _enough(ensemble)
    if quantity != "n_p" and not ensemble.failed:
        raise Missing(f"{ensemble.run.path}: not broken to failure")
    return goodness(spread_integers(getattr(ensemble, quantity)), FAMILIES["normal"])


def _enough(ensemble):
    if len(ensemble) < LEAST_SAMPLES or np.ptp(ensemble.strength) == 0:
        raise Missing(f"{ensemble.model}, L = {ensemble.size}: {LEAST_SAMPLES} samples are needed, "
                      f"{len(ensemble)} there")
