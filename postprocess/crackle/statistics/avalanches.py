"""Avalanches under controlled load, and the exponent of their distribution.

As the load is raised, an avalanche starts where P_k exceeds every earlier P, and holds all breaks until the next
such. The last one, which starts at the peak load, ends in failure and is kept apart. The others follow

    P(s) = s^-tau exp(-s/s_0) / Z,   s_0 = A N^(D/2),   Z = sum over s_min <= s <= N,

N the number of bonds, with one tau, A and D for all sizes: fitted by maximum likelihood to the counts themselves
(no bins). For given D this is an exponential family in (tau, 1/A), so that the likelihood has one maximum.
Source of the likelihood approach: Clauset, Shalizi, Newman, SIAM Review 51 (2009) 661.
"""
from dataclasses import dataclass

import numpy as np
from scipy.optimize import minimize
from scipy.sparse import csr_matrix


def avalanche_sizes(load):
    """Sizes of the avalanches of one sample, in order, the last (catastrophic) one last. load: [B] P_k."""
    load = np.asarray(load)
    if not len(load):
        return np.zeros(0, dtype=np.int64)
    before = np.concatenate([[-np.inf], np.maximum.accumulate(load)[:-1]])
    starts = np.flatnonzero(load > before)
    return np.diff(np.append(starts, len(load)))


def size_counts(sizes):
    """Avalanches of each size in each sample, the last left out: sparse [S, largest + 1], column s for size s.

    sizes: a list of S arrays as avalanche_sizes gives them.
    """
    without_last = [s[:-1] for s in sizes]
    row = np.repeat(np.arange(len(sizes)), [len(s) for s in without_last])
    column = np.concatenate(without_last) if row.size else np.zeros(0, dtype=int)
    width = int(column.max()) + 1 if row.size else 2
    return csr_matrix((np.ones(len(row)), (row, column)), shape=(len(sizes), width))


def log_bins(largest, per_decade=8):
    """Edges of bins of integers that widen geometrically, the first ones one integer wide: [B + 1]."""
    decades = np.log10(max(largest, 2) + 1)
    edges = np.unique(np.round(10 ** np.linspace(0, decades, int(np.ceil(decades * per_decade)) + 1)))
    edges[-1] = largest + 1
    return edges.astype(int)


def binned_density(counts, edges):
    """Probability per unit of size in every bin. counts: [..., largest + 1]; returns centres, density [..., B].

    The centre is the geometric mean of a bin's first and last integer.
    """
    counts = np.asarray(counts, dtype=float)
    total = counts[..., 1:].sum(axis=-1, keepdims=True)
    padded = np.concatenate([counts, np.zeros(counts.shape[:-1] + (max(0, edges[-1] + 1 - counts.shape[-1]),))],
                            axis=-1)
    cumulative = np.cumsum(padded, axis=-1)
    in_bin = cumulative[..., edges[1:] - 1] - cumulative[..., edges[:-1] - 1]
    return np.sqrt(edges[:-1] * (edges[1:] - 1.0)), in_bin / np.diff(edges) / total


@dataclass
class AvalancheFit:
    tau: float
    dimension: float  # D; nan if only one size was given
    amplitude: float  # A
    s_min: int
    likelihood: float
    score: float      # sqrt(n) D, D the Kolmogorov-Smirnov distance at a size, n its avalanches: the largest one


class AvalancheModel:
    """The likelihood of counts at several sizes.

    counts: a list of [largest + 1] (column s for size s); bonds: N of each. Sizes without an avalanche of s_min
    or more are an error.
    """

    def __init__(self, counts, bonds, s_min):
        self.bonds, self.s_min = np.asarray(bonds, dtype=float), s_min
        self.size = [np.arange(s_min, int(n) + 1, dtype=float) for n in bonds]
        self.log_size = [np.log(s) for s in self.size]
        self.set_counts(counts)

    def set_counts(self, counts):
        """The same model for other counts at the same sizes."""
        self.counts = [np.asarray(c, dtype=float)[self.s_min:] for c in counts]
        if min(c.sum() for c in self.counts) <= 0:
            raise ValueError(f"no avalanche of {self.s_min} breaks or more at some size")
        self.total = np.array([c.sum() for c in self.counts])
        self.sum_log = np.array([c @ x[:len(c)] for c, x in zip(self.counts, self.log_size)])
        self.sum_size = np.array([c @ x[:len(c)] for c, x in zip(self.counts, self.size)])

    def _terms(self, i, tau, rate):
        """Unnormalised probabilities at size number i, cut where they are below 1e-18 of the first."""
        keep = len(self.size[i]) if rate <= 0 else min(len(self.size[i]), int(40 / rate) + 2)
        return np.exp(-tau * self.log_size[i][:keep] - rate * (self.size[i][:keep] - self.s_min))

    def cost(self, parameters):
        """Minus the log-likelihood per avalanche and its gradient, at (tau, ln A[, D])."""
        tau, log_a, dimension = (*parameters, 0.0)[:3]
        log_bonds = np.log(self.bonds) / 2
        rates = np.exp(-log_a - dimension * log_bonds)
        value, by_tau, by_rate = 0.0, 0.0, np.zeros(len(rates))
        for i, rate in enumerate(rates):
            terms = self._terms(i, tau, rate)
            z = terms.sum()
            log_z = np.log(z) - rate * self.s_min
            value += tau * self.sum_log[i] + rate * self.sum_size[i] + self.total[i] * log_z
            by_tau += self.sum_log[i] - self.total[i] * (terms @ self.log_size[i][:len(terms)]) / z
            by_rate[i] = self.sum_size[i] - self.total[i] * (terms @ self.size[i][:len(terms)]) / z
        by_log_a = -np.sum(by_rate * rates)
        by_dimension = -np.sum(by_rate * rates * log_bonds)
        gradient = np.array([by_tau, by_log_a, by_dimension])[:len(parameters)]
        return value / self.total.sum(), gradient / self.total.sum()

    def score(self, tau, log_a, dimension):
        """sqrt(n) times the largest difference of the cumulative distributions, fitted and counted; the worst size's."""
        largest = 0.0
        for i, counts in enumerate(self.counts):
            model = self._terms(i, tau, np.exp(-log_a - dimension / 2 * np.log(self.bonds[i])))
            found = np.zeros(len(model))
            found[:len(counts)] = counts[:len(model)]
            difference = np.cumsum(found) / self.total[i] - np.cumsum(model) / model.sum()
            largest = max(largest, np.sqrt(self.total[i]) * np.max(np.abs(difference)))
        return largest

    def fit(self, start=None):
        """The most likely tau, A and, of several sizes, D."""
        several = len(self.bonds) > 1
        start = start if start is not None else ([2.0, 0.0, 1.0] if several else [2.0, 2.0])
        found = minimize(self.cost, start, jac=True, method="L-BFGS-B", options={"ftol": 1e-13, "gtol": 1e-8},
                         bounds=[(0.0, 6.0), (-6.0, 16.0), (-1.0, 4.0)][:len(start)])
        tau, log_a, dimension = (*found.x, 0.0)[:3]
        return AvalancheFit(tau, dimension if several else np.nan, float(np.exp(log_a)), self.s_min,
                            -found.fun * self.total.sum(), self.score(tau, log_a, dimension))


def fit_avalanches(counts, bonds, s_min):
    """Maximum likelihood over all sizes together; see AvalancheModel."""
    return AvalancheModel(counts, bonds, s_min).fit()


def fit_avalanches_resampled(resampled, bonds, fit):
    """tau, D and A of every resample: float[R, 3]. resampled: a list, one entry a size, of [R, largest + 1]."""
    start = [fit.tau, np.log(fit.amplitude)] + ([] if np.isnan(fit.dimension) else [fit.dimension])
    model = AvalancheModel([counts[0] for counts in resampled], bonds, fit.s_min)
    found = []
    for counts in zip(*resampled):
        model.set_counts(counts)
        one = model.fit(start)
        found.append((one.tau, one.dimension, one.amplitude))
    return np.array(found)


NOT_REJECTED = 0.9  # sqrt(n) D that 5 % of samples exceed, roughly, after two parameters were fitted to them


def choose_s_min(counts, bonds, candidates=range(1, 13)):
    """The smallest s_min from which on the law is not rejected; if it always is, the one that comes nearest.

    The measure is the fits' score. At least 50 avalanches of s_min breaks or more must be there at every size.
    Returns the fit and the fits at all candidates.
    """
    fits = []
    for s_min in candidates:
        if min(np.asarray(c)[s_min:].sum() for c in counts) < 50:
            break
        fits.append(fit_avalanches(counts, bonds, s_min))
    if not fits:
        raise ValueError("fewer than 50 avalanches at some size")
    accepted = [fit for fit in fits if fit.score < NOT_REJECTED]
    return (accepted[0] if accepted else min(fits, key=lambda fit: fit.score)), fits
