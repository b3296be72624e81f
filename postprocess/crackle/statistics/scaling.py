"""How a mean depends on size: weighted least squares of the laws that are linear but for one exponent.

    power law            y = A x^b
    shifted power law    F = C0 L^alpha + C1            (mean peak load)
    logarithmic law      mu = mu_star (ln L)^-psi + c/L (mean strength)

Each is y = theta_1 f_1(x; e) + theta_2 f_2(x; e): for a given exponent e a linear problem, so that only e
has to be searched (variable projection: Golub and Pereyra, SIAM J. Numer. Anal. 10 (1973) 413).
"""
from dataclasses import dataclass

import numpy as np
from scipy.optimize import minimize_scalar
from scipy.stats import chi2

from crackle.statistics.bootstrap import estimate


@dataclass
class Law:
    """y = sum of coefficients times basis(x, exponent)."""
    text: str
    basis: callable  # (x, exponent) to [len(x), coefficients]
    bounds: tuple    # where the exponent is looked for
    coefficients: int

    def __call__(self, x, fit):
        return self.basis(np.asarray(x, dtype=float), fit.exponent) @ fit.coefficients


@dataclass
class Fit:
    exponent: float
    coefficients: np.ndarray
    chi_squared: float
    degrees: int  # of freedom; 0: the law goes through every point and nothing is tested

    @property
    def p_value(self):
        return float(chi2.sf(self.chi_squared, self.degrees)) if self.degrees > 0 else None

    @property
    def misfit(self):
        return self.chi_squared / self.degrees if self.degrees > 0 else None


POWER_LAW = Law("$A\\,x^b$", lambda x, e: x[:, None] ** e, (-3.0, 4.0), 1)
SHIFTED_POWER_LAW = Law("$C_0 L^{\\alpha} + C_1$",
                        lambda x, e: np.stack([x ** e, np.ones_like(x)], axis=1), (0.3, 1.6), 2)
LOGARITHMIC_LAW = Law("$\\mu^\\ast (\\ln L)^{-\\psi} + c/L$",
                      lambda x, e: np.stack([np.log(x) ** -e, 1 / x], axis=1), (-1.0, 3.0), 2)


def fit_law(law, x, y, error, near=None):
    """Weighted least squares. x, y, error: [K], error > 0 the standard errors of y; K > law.coefficients.

    near: an exponent close to the best one; without it the law's whole range is searched.

    Raises ValueError for fewer points than the law has unknowns.
    """
    x, y, error = (np.asarray(values, dtype=float) for values in (x, y, error))
    unknowns = law.coefficients + 1
    if len(x) < unknowns:
        raise ValueError(f"{unknowns} sizes are needed, {len(x)} there")

    def solve(exponent):
        scaled = law.basis(x, exponent) / error[:, None]
        coefficients, *_ = np.linalg.lstsq(scaled, y / error, rcond=None)
        return coefficients, float(np.sum((scaled @ coefficients - y / error) ** 2))

    if near is None:
        grid = np.linspace(*law.bounds, 60)
        near = grid[np.argmin([solve(e)[1] for e in grid])]
    step = (law.bounds[1] - law.bounds[0]) / 100
    found = minimize_scalar(lambda e: solve(e)[1], bracket=(near - step, near + step), method="brent",
                            options={"xtol": 1e-7})
    coefficients, chi_squared = solve(found.x)
    return Fit(float(found.x), coefficients, chi_squared, len(x) - unknowns)


def fit_resampled(law, x, y, resampled):
    """The fit to y, its errors from the resamples, and the exponent with its interval.

    y: [K]; resampled: [R, K], the means of every resample. Returns Fit, Estimate.
    """
    error = np.std(resampled, axis=0, ddof=1)
    if not np.all(error > 0):
        raise ValueError("no scatter between samples at some size: more samples are needed")
    fit = fit_law(law, x, y, error)
    exponents = [fit_law(law, x, row, error, fit.exponent).exponent for row in resampled]
    return fit, estimate(fit.exponent, exponents, fit.misfit, fit.p_value)
