"""Reads what crackle_compare leaves behind.

    from comparison_file import read_comparison
    comparison = read_comparison("compare.h5")
    for strategy in comparison.strategies:
        print(strategy.name, strategy.ms_per_break, strategy.first_difference)
"""
import os
from dataclasses import dataclass, field

import h5py
import numpy as np

SCHEMA_VERSION = 1
SERIES = ("time", "total", "set_up", "phase", "iterations", "residual", "backward_error", "force_error",
          "load_error")
PHASES = ("assembly", "factor", "downdate", "solve", "search", "output")  # columns of `phase`


@dataclass
class Strategy:
    """One solver with one tolerance. R repetitions, K measured breaks; NaN: not reached."""
    name: str
    family: str                 # the name without the tolerance
    rtol: float                 # NaN where it has none
    attributes: dict            # first_difference, n_p, n_f, memory, complaint, ... as in the file
    series: dict = field(repr=False)  # "force_error" to float64[K], "time" to float64[R, K], ...
    breaks: int = 0             # that were timed

    @property
    def ms_per_break(self):
        """Fastest repetition, milliseconds; NaN when it did not come to the end."""
        return 1e3 * np.min(self.series["total"]) / self.breaks

    @property
    def force_error(self):
        """Median over the measured breaks; NaN when it did not come to the end."""
        return float(np.median(self.series["force_error"]))

    @property
    def first_difference(self):
        """Number of the first break at which it names another bond; 0: none."""
        return int(self.attributes["first_difference"])


@dataclass
class Comparison:
    path: str
    options: dict               # "-name" to value, both as text
    reference: dict             # attributes of /reference
    number: np.ndarray          # int64[K] breaks measured, from 1
    reference_error: np.ndarray  # float64[K]
    stiffness: np.ndarray       # float64[B]
    strategies: list

    def title(self):
        return f"{self.options['-model']}, L = {self.options['-lattice_size']}"


def read_comparison(path):
    """Raises ValueError, in one line, if the file is missing, damaged or of another kind or schema."""
    path = os.fspath(path)
    if not os.path.isfile(path):
        raise ValueError(f"{path}: no such file")
    try:
        with h5py.File(path, "r") as file:
            return _read(path, file)
    except (OSError, KeyError, RuntimeError) as error:
        raise ValueError(f"{path}: not a comparison of crackle_compare, or damaged") from error


def _read(path, file):
    if _text(file.attrs.get("kind", "")) != "comparison":
        raise ValueError(f"{path}: not a comparison of crackle_compare")
    if int(file.attrs["schema_version"]) != SCHEMA_VERSION:
        raise ValueError(f"{path}: schema version {file.attrs['schema_version']}; this module reads {SCHEMA_VERSION}")
    reference = file["reference"]
    attributes = {name: _plain(value) for name, value in reference.attrs.items()}
    breaks = int(attributes["n_f"]) - int(attributes["skip"])
    strategies = [_read_strategy(group, breaks) for _, group in sorted(file["strategies"].items())]
    options = dict((line.split(" ", 1) + [""])[:2] for line in _text(file.attrs["options"]).splitlines())
    return Comparison(path, options, attributes, reference["number"][...], reference["error"][...],
                      reference["stiffness"][...], strategies)


def _read_strategy(group, breaks):
    attributes = {name: _plain(value) for name, value in group.attrs.items()}
    rtol = attributes["rtol"]
    family = attributes["name"][:-len(rtol)].strip() if rtol else attributes["name"]
    series = {name: group[name][...] for name in SERIES}
    return Strategy(attributes["name"], family, float(rtol) if rtol else np.nan, attributes, series, breaks)


def _text(value):
    value = np.ravel(value)[0] if isinstance(value, np.ndarray) else value
    return value.decode() if isinstance(value, bytes) else str(value)


def _plain(value):
    value = np.ravel(value)[0] if isinstance(value, np.ndarray) else value
    return value.decode() if isinstance(value, bytes) else value.item() if hasattr(value, "item") else value
