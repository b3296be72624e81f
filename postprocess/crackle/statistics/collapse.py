"""Data collapse: do curves of several sizes, rescaled, fall on one? Its quality, and the exponents that make it best.

The quality is that of Houdayer and Hartmann (Phys. Rev. B 70 (2004) 014418): S = mean over points of
(y - Y)^2 / (dy^2 + dY^2), Y the master curve at the point's x as the other sizes give it. Here Y is the weighted mean of
the other curves, each interpolated linearly between the two points that bracket x; a point that no other curve
reaches is not counted. S is about 1 where curves agree within their errors, and more where they do not.
"""
from dataclasses import dataclass

import numpy as np
from scipy.optimize import minimize

LEAST_OVERLAP = 0.5  # share of all points that must be bracketed by another curve; less is no collapse


@dataclass
class Curve:
    """One size: points of ascending x with standard errors of y, all float[K]."""
    size: float
    x: np.ndarray
    y: np.ndarray
    error: np.ndarray


def interpolate(curve, x):
    """y and its variance at x by linear interpolation, nan outside the curve."""
    right = np.clip(np.searchsorted(curve.x, x), 1, len(curve.x) - 1)
    left = right - 1
    part = (x - curve.x[left]) / (curve.x[right] - curve.x[left])
    inside = (x >= curve.x[0]) & (x <= curve.x[-1])
    y = (1 - part) * curve.y[left] + part * curve.y[right]
    variance = ((1 - part) * curve.error[left]) ** 2 + (part * curve.error[right]) ** 2
    return np.where(inside, y, np.nan), np.where(inside, variance, np.nan)


def quality(curves):
    """S of curves that are already rescaled; inf when they overlap too little to be compared."""
    terms, points = [], 0
    for i, curve in enumerate(curves):
        others = [interpolate(other, curve.x) for j, other in enumerate(curves) if j != i]
        y = np.stack([other[0] for other in others])
        with np.errstate(divide="ignore"):
            weight = np.where(np.isfinite(y), 1 / np.stack([other[1] for other in others]), 0.0)
        total = weight.sum(axis=0)
        met = total > 0
        master = np.nansum(np.where(weight > 0, y * weight, 0.0), axis=0)[met] / total[met]
        terms.append((curve.y[met] - master) ** 2 / (curve.error[met] ** 2 + 1 / total[met]))
        points += len(curve.x)
    terms = np.concatenate(terms)
    return float(terms.mean()) if len(terms) >= LEAST_OVERLAP * points else np.inf


@dataclass
class Collapse:
    exponents: np.ndarray
    quality: float


def best_collapse(curves, rescale, start, steps, searches=3):
    """The exponents that make the quality least (Nelder and Mead), from `start`, first simplex `steps` wide.

    The quality jumps a little where a point gains or loses its neighbours: the search starts anew from where it ended,
    to either side in turn, `searches` times in all; from a start known to be good, one is enough.

    rescale(curve, exponents) gives the rescaled Curve. Raises ValueError with fewer than two curves.
    """
    if len(curves) < 2:
        raise ValueError("2 sizes are needed")
    best, value = np.asarray(start, dtype=float), np.inf
    for search in range(searches):
        simplex = np.vstack([best, best + (-1) ** search * np.diag(steps)])
        found = minimize(lambda e: min(quality([rescale(curve, e) for curve in curves]), 1e12), best,
                         method="Nelder-Mead",
                         options={"initial_simplex": simplex, "xatol": 1e-3, "fatol": 1e-3, "maxiter": 200})
        if found.fun < value:
            best, value = found.x, float(found.fun)
    return Collapse(best, value)
