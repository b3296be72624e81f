"""What the paper reports: its tables, its exponents, and its tables fitted as ours are.

Source: P. K. V. V. Nukala, S. Zapperi, S. Simunovic, Phys. Rev. E 71 (2005) 066106, in the folder paper_tables/.
"""
import csv
from functools import cache
from pathlib import Path

import numpy as np

from crackle.statistics.bootstrap import estimate
from crackle.statistics.scaling import LOGARITHMIC_LAW, POWER_LAW, SHIFTED_POWER_LAW, fit_law

FOLDER = Path(__file__).resolve().parent / "paper_tables"
NOISE = 200  # draws of the tables' sampling errors


def _rows(name):
    with open(FOLDER / name, encoding="utf-8") as file:
        return list(csv.DictReader(line for line in file if not line.startswith("#")))


@cache
def spring_tables():
    """Tables 1 and 2 (spring model): column name to float[sizes]."""
    rows = _rows("spring_tables.csv")
    return {name: np.array([float(row[name]) for row in rows]) for name in rows[0]}


@cache
def exponents():
    """(key, model) to the paper's text, "0.92"; without those it does not give."""
    return {(row["key"], model): row[model] for row in _rows("exponents.csv")
            for model in ("spring", "fuse") if row[model]}


def rounding(text):
    """Half a unit of the last digit."""
    return 0.5 * 10.0 ** -len(text.partition(".")[2])


@cache
def refitted(key, least_size):
    """The exponent that our fit gives on the paper's tables (spring model), with their sampling errors; else None."""
    table = spring_tables()
    size, samples = table["L"], table["n_samples"]
    bonds = (3 * size + 1) * (size + 1)
    laws = {  # abscissa, mean, standard deviation, law
        "n_p": (bonds, bonds * table["p_p"], bonds * table["p_p_std"], POWER_LAW),
        "last_avalanche": (bonds, bonds * (table["p_f"] - table["p_p"]),
                           bonds * np.hypot(table["p_f_std"], table["p_p_std"]), POWER_LAW),
        "peak_load": (size, table["peak_load"], table["peak_load_std"], SHIFTED_POWER_LAW),
        "strength": (size, table["peak_load"] / size, table["peak_load_std"] / size, LOGARITHMIC_LAW),
    }
    if key not in laws:
        return None
    x, mean, deviation, law = laws[key]
    used = size >= least_size
    x, mean, error = x[used], mean[used], (deviation / np.sqrt(samples))[used]
    random = np.random.default_rng(1)
    fit = fit_law(law, x, mean, error)
    noisy = [fit_law(law, x, random.normal(mean, error), error, fit.exponent).exponent for _ in range(NOISE)]
    return estimate(fit.exponent, noisy, fit.misfit, fit.p_value)
