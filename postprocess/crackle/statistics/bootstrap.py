"""Bootstrap over samples: how far off a number is that was made from S independent samples.

Every statistic here is a function of means over samples (of n_p, of avalanche counts, of profiles). One resample
draws S samples with replacement; a sample drawn w times has weight w. All statistics of an ensemble share its
weights, so that they keep their correlations:

    weights = resampling_weights(len(n_p), RESAMPLES, seed=1)     # [R, S]
    means = weighted_means(weights, n_p)                          # [R]
    low, high = interval(means)

Source: B. Efron and R. J. Tibshirani, An Introduction to the Bootstrap (1993), chapters 6 and 13.
"""
from dataclasses import dataclass
from typing import Optional

import numpy as np

LEVEL = 0.95  # of every interval
RESAMPLES = 400


@dataclass
class Estimate:
    """A number with the interval that holds it at LEVEL, and how well the fit behind it describes the data."""
    value: float
    low: float
    high: float
    misfit: Optional[float] = None   # chi-squared, or a collapse's quality, per degree of freedom
    p_value: Optional[float] = None  # of chi-squared; None if the fit has no degree of freedom left

    @property
    def error(self):
        """Half the interval in units of a normal distribution's standard deviation."""
        return (self.high - self.low) / (2 * 1.96)


def resampling_weights(samples, resamples, seed):
    """How often each sample is drawn in each resample: float32[resamples, samples], rows summing to samples."""
    random = np.random.default_rng(seed)
    return np.stack([np.bincount(random.integers(samples, size=samples), minlength=samples)
                     for _ in range(resamples)]).astype(np.float32)


def weighted_means(weights, values):
    """The mean over samples in every resample. values: [S, ...], dense or scipy.sparse. Returns [R, ...]."""
    if hasattr(values, "tocsr"):
        return np.asarray((values.T @ weights.T.astype(float)).T) / weights.shape[1]
    values = np.asarray(values, dtype=float)
    flat = weights.astype(float) @ values.reshape(len(values), -1) / weights.shape[1]
    return flat.reshape((len(weights),) + values.shape[1:])


def interval(resampled, level=LEVEL):
    """The percentile interval over resamples (axis 0), those that are not finite left out."""
    resampled = np.asarray(resampled, dtype=float)
    tail = 50 * (1 - level)
    return tuple(np.nanpercentile(np.where(np.isfinite(resampled), resampled, np.nan), [tail, 100 - tail],
                                  axis=0))


def estimate(value, resampled, misfit=None, p_value=None):
    """An Estimate from the value of all samples and those of the resamples."""
    low, high = interval(resampled)
    return Estimate(float(value), float(low), float(high), misfit, p_value)
