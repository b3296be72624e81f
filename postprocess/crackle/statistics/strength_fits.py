"""Distributions of strength: normal, lognormal, Weibull and modified Gumbel, each fitted by maximum likelihood.

Weibull and modified Gumbel are weakest-link laws: a sample of area L^2 survives the stress sigma with probability

    1 - P(sigma) = exp(-L^2 c exp(-k z)),   z = -ln sigma (Weibull, k = m),   z = sigma^-delta (modified Gumbel).

So A = -ln[-ln(1 - P) / L^2] = k z - ln c is a straight line in z, the same for all L. For given z the most likely k
solves 1/k = <z> - <z>_w with weights L^2 exp(-k z), and c = n / sum of those weights; delta is then a search
in one variable. Strengths are divided by their geometric mean first, so that no power overflows.

Families have one size at a time (the area is in c); fit_weakest_link fits all sizes with one k and c.
"""
from dataclasses import dataclass

import numpy as np
from scipy import stats
from scipy.optimize import minimize_scalar

DELTA_BOUNDS = (0.05, 60.0)  # towards 0 the modified Gumbel distribution turns into Weibull's


@dataclass
class Fitted:
    """A distribution with its parameters: functions of sigma, and random strengths."""
    family: str
    parameters: dict
    cdf: callable
    log_density: callable
    draw: callable  # (random generator, n) to strengths
    count: int      # free parameters


def weakest_link_scale(z, area):
    """The most likely k and ln c of z with survival exp(-area c exp(-k z)). z, area: float[n]."""
    mean, span = z.mean(), z.std()
    if not span > 0:
        raise ValueError("all strengths are equal")
    k = np.pi / np.sqrt(6) / span
    for _ in range(60):
        weight = area * np.exp(-k * (z - mean))
        weight /= weight.sum()
        tilted = weight @ z
        spread = weight @ (z - tilted) ** 2
        step = (1 / k - mean + tilted) / (1 / k ** 2 + spread)  # Newton's, on a decreasing function of k
        k = max(k + step, k / 4)
        if abs(step) < 1e-10 * k:
            break
    log_c = np.log(len(z)) - np.log(np.sum(area * np.exp(-k * (z - mean)))) + k * mean
    return k, log_c


def weakest_link_likelihood(z, area, k, log_c):
    """The log-density of every z."""
    exponent = log_c - k * z + np.log(area)
    return np.log(k) + exponent - np.exp(np.minimum(exponent, 700.0))


def fit_normal(sigma):
    mean, deviation = sigma.mean(), sigma.std()
    law = stats.norm(mean, deviation)
    return Fitted("normal", {"mean": mean, "deviation": deviation}, law.cdf, law.logpdf,
                  lambda random, n: random.normal(mean, deviation, n), 2)


def fit_lognormal(sigma):
    """eta and zeta: mean and standard deviation of ln sigma."""
    log = np.log(sigma)
    eta, zeta = log.mean(), log.std()
    return Fitted("lognormal", {"eta": eta, "zeta": zeta},
                  lambda s: stats.norm.cdf(np.log(s), eta, zeta),
                  lambda s: stats.norm.logpdf(np.log(s), eta, zeta) - np.log(s),
                  lambda random, n: np.exp(random.normal(eta, zeta, n)), 2)


def fit_weibull(sigma):
    """1 - P = exp(-(sigma/scale)^m)."""
    m, log_c = weakest_link_scale(-np.log(sigma), np.ones(len(sigma)))
    scale = np.exp(-log_c / m)
    return Fitted("Weibull", {"m": m, "scale": scale},
                  lambda s: -np.expm1(-(s / scale) ** m),
                  lambda s: np.log(m / s) + m * np.log(s / scale) - (s / scale) ** m,
                  lambda random, n: scale * random.weibull(m, n), 2)


def _best_delta(log_sigma, area):
    """delta, k, ln c of the modified Gumbel law for strengths of geometric mean 1."""

    def cost(log_delta):
        delta = np.exp(log_delta)
        z = np.exp(-delta * log_sigma)
        k, log_c = weakest_link_scale(z, area)
        return -np.mean(weakest_link_likelihood(z, area, k, log_c) + log_delta - delta * log_sigma)

    found = minimize_scalar(cost, bounds=np.log(DELTA_BOUNDS), method="bounded", options={"xatol": 1e-4})
    delta = np.exp(found.x)
    return (delta, *weakest_link_scale(np.exp(-delta * log_sigma), area))


def fit_gumbel(sigma):
    """Modified Gumbel: 1 - P = exp(-c exp(-k (unit/sigma)^delta)), unit the geometric mean."""
    unit = np.exp(np.log(sigma).mean())
    delta, k, log_c = _best_delta(np.log(sigma / unit), np.ones(len(sigma)))

    def log_hazard(s):  # ln of -ln(1 - P)
        return np.minimum(log_c - k * (s / unit) ** -delta, 700.0)

    def log_density(s):
        z = (s / unit) ** -delta
        return weakest_link_likelihood(z, 1.0, k, log_c) + np.log(delta * z / s)

    def draw(random, n):
        z = (log_c - np.log(np.maximum(random.exponential(size=n), 1e-300))) / k
        return unit * np.maximum(z, 1e-12) ** (-1 / delta)

    return Fitted("modified Gumbel", {"delta": delta, "k": k, "ln c": log_c, "unit": unit},
                  lambda s: -np.expm1(-np.exp(log_hazard(s))), log_density, draw, 3)


FAMILIES = {"normal": fit_normal, "lognormal": fit_lognormal, "Weibull": fit_weibull,
            "modified Gumbel": fit_gumbel}


@dataclass
class WeakestLink:
    """One weakest-link law for all sizes: A = k z - ln c with z(sigma / unit)."""
    delta: float  # 0: Weibull, z = -ln(sigma / unit)
    k: float
    log_c: float
    unit: float

    def z(self, sigma):
        ratio = np.asarray(sigma) / self.unit
        return ratio ** -self.delta if self.delta > 0 else -np.log(ratio)

    def line(self, z):
        return self.k * z - self.log_c


def fit_weakest_link(strengths, sizes, gumbel):
    """The most likely WeakestLink over all sizes. strengths: a list of float[S]; sizes: L of each."""
    sigma = np.concatenate(strengths)
    unit = np.exp(np.mean([np.log(s).mean() for s in strengths]))
    log_sigma = np.log(sigma / unit)
    area = np.repeat(np.asarray(sizes, dtype=float) ** 2, [len(s) for s in strengths])
    if gumbel:
        return WeakestLink(*_best_delta(log_sigma, area), unit)
    return WeakestLink(0.0, *weakest_link_scale(-log_sigma, area), unit)


def reduced_log_survival(probability, size):
    """The paper's A = -ln[-ln(1 - P) / L^2]."""
    return -np.log(-np.log1p(-probability) / size ** 2)
