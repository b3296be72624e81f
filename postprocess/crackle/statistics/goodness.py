"""How well a fitted distribution describes a sample, and which of two describes it better.

Kolmogorov-Smirnov: D = sup |P_n - P|. Anderson-Darling: A^2 = -n - 1/n sum (2i-1) [ln P_i + ln(1 - P_(n+1-i))],
which looks harder at the tails. The parameters were fitted to the same data, so the textbook tables do not hold:
p-values come from a parametric bootstrap, in which samples drawn from the fitted distribution are fitted anew.
Source: M. A. Stephens, J. Am. Stat. Assoc. 69 (1974) 730.

Which of two is better: Vuong's test (Econometrica 57 (1989) 307) on the log-likelihood ratio per sample, each with the
penalty of Akaike's criterion for its parameters.
"""
from dataclasses import dataclass

import numpy as np
from scipy.stats import norm

DRAWS = 199         # of the parametric bootstrap: p-values in steps of 1/200
LARGEST_DRAW = 500  # sqrt(n) D and A^2 no longer depend on n there, so that draws need not be longer
TINY = 1e-300


def ks_distance(sigma, cdf):
    """sqrt(n) D."""
    p = cdf(np.sort(sigma))
    n = len(p)
    rank = np.arange(1, n + 1)
    return np.sqrt(n) * max(np.max(rank / n - p), np.max(p - (rank - 1) / n))


def ad_distance(sigma, cdf):
    """A^2."""
    p = cdf(np.sort(sigma))
    n = len(p)
    odd = 2 * np.arange(1, n + 1) - 1
    return -n - np.mean(odd * (np.log(np.maximum(p, TINY)) + np.log(np.maximum(1 - p[::-1], 1e-16))))


@dataclass
class Goodness:
    ks: float      # sqrt(n) D
    ks_p: float
    ad: float      # A^2
    ad_p: float


def goodness(sigma, fit, seed=1, draws=DRAWS):
    """Distances of the sample to its own fit, with the share of drawn samples that lie further from theirs."""
    fitted = fit(sigma)
    ks, ad = ks_distance(sigma, fitted.cdf), ad_distance(sigma, fitted.cdf)
    random = np.random.default_rng(seed)
    further = np.zeros(2)
    for _ in range(draws):
        drawn = fitted.draw(random, min(len(sigma), LARGEST_DRAW))
        again = fit(drawn)
        further += (ks_distance(drawn, again.cdf) >= ks, ad_distance(drawn, again.cdf) >= ad)
    ks_p, ad_p = (further + 1) / (draws + 1)
    return Goodness(ks, ks_p, ad, ad_p)


@dataclass
class Comparison:
    ratio: float    # mean ln(f_1/f_2) per sample, penalised; above 0: the first describes the data better
    score: float    # ratio in its standard errors
    p_value: float  # of no difference


def compare(sigma, first, second):
    """Vuong's test between two Fitted distributions."""
    difference = first.log_density(sigma) - second.log_density(sigma)
    n = len(sigma)
    ratio = difference.mean() - (first.count - second.count) / n
    error = difference.std(ddof=1) / np.sqrt(n)
    score = ratio / error if error > 0 else 0.0
    return Comparison(float(ratio), float(score), float(2 * norm.sf(abs(score))))


def spread_integers(counts, seed=1):
    """Integers plus uniform noise in [-1/2, 1/2): the steps of a count are no misfit of a continuous law."""
    return counts + np.random.default_rng(seed).random(len(counts)) - 0.5
