"""Reads what crackle_compare leaves behind.

    from crackle.files import read_comparison
    comparison = read_comparison("compare.h5")
    for strategy in comparison.strategies:
        print(strategy.name, strategy.ms_per_break, strategy.first_difference)
"""
import os
from dataclasses import dataclass, field

import h5py
import numpy as np

from crackle.files.hdf5_file import array, check_version, has, number, open_file, read_options, same_length, text

SCHEMA_VERSIONS = (1, 2)  # 2: with checksums
TIMES = ("time", "total", "set_up", "phase")
ERRORS = ("residual", "backward_error", "force_error", "load_error")  # NaN: not reached
SERIES = (*TIMES, "iterations", *ERRORS)
TEXTS = ("name", "rtol", "complaint", "options")
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

    @property
    def size(self):
        """L; None for a network from a file."""
        return int(self.options["-lattice_size"]) if "-lattice_size" in self.options else None

    def title(self):
        if self.size is None:
            return f"network {self.options.get('-lattice_file', 'from a file')}"
        return f"{self.options['-model']}, L = {self.size}"


def read_comparison(path):
    """Raises ValueError, in one line, if the file is missing, damaged, of another kind or schema, or holds what can't be
    true of a comparison.
    """
    path = os.fspath(path)
    if not os.path.isfile(path):
        raise ValueError(f"{path}: no such file")
    with open_file(path) as file:
        return _read(path, file)


def _read(path, file):
    if "kind" not in file.attrs or text(file, "kind") != "comparison":
        raise ValueError("not a comparison of crackle_compare")
    check_version(file, SCHEMA_VERSIONS)
    for group in ("reference", "strategies"):
        if not has(file, group) or not isinstance(file[group], h5py.Group):
            raise ValueError(f"group /{group}: missing")
    reference = _read_attributes(file["reference"], ("name", "peak_load", "n_p", "n_f", "skip"))
    measured, error = array(file, "reference/number", np.int64, 1), array(file, "reference/error", np.float64, 1)
    stiffness = _read_breaks(file, reference)
    _check_measured(reference, measured, error)
    strategies = [_read_strategy(file, name, len(measured), len(stiffness)) for name in sorted(file["strategies"])]
    return Comparison(path, read_options(file), reference, measured, error, stiffness, strategies)


def _read_attributes(group, expected):
    """All attributes, as numbers and texts. Raises ValueError when one of `expected` is missing or of another kind."""
    attributes = {name: text(group, name) if np.asarray(group.attrs[name]).dtype.kind in "SOU" else number(group, name)
                  for name in group.attrs}
    for name in expected:
        if isinstance(attributes.get(name), str) != (name in TEXTS):
            raise ValueError(f"attribute {name} of {group.name}: it must be a {'text' if name in TEXTS else 'number'}")
    return attributes


def _read_breaks(file, reference):
    """The stiffnesses of the B breaks that were timed."""
    n_p, n_f, skip = (reference[name] for name in ("n_p", "n_f", "skip"))
    if not (0 <= skip <= n_f and 0 <= n_p <= n_f):
        raise ValueError(f"attributes of /reference: skip {skip}, n_p {n_p}; allowed are 0 to n_f, {n_f}")
    bond = array(file, "reference/bond", np.int32, 1)
    load, stiffness = (array(file, f"reference/{name}", np.float64, 1) for name in ("load", "stiffness"))
    same_length({"reference/bond": bond}, n_f)
    same_length({"reference/load": load, "reference/stiffness": stiffness}, n_f - skip)
    if np.any(bond < 0) or len(np.unique(bond)) != len(bond):
        raise ValueError("dataset /reference/bond: a bond below 0, or twice")
    if not (np.isfinite(load).all() and np.all(load >= 0)):
        raise ValueError("dataset /reference/load: allowed are finite numbers from 0")
    if not (np.isfinite(stiffness).all() and np.all(stiffness > 0)):
        raise ValueError("dataset /reference/stiffness: allowed are finite numbers above 0")
    return stiffness


def _check_measured(reference, measured, error):
    same_length({"reference/error": error}, len(measured))
    ascends = np.all(np.diff(measured) > 0)
    if len(measured) and not (ascends and reference["skip"] < measured[0] and measured[-1] <= reference["n_f"]):
        raise ValueError("dataset /reference/number: it must ascend from skip + 1 to n_f at most")
    if np.any(error < 0) or np.isinf(error).any():
        raise ValueError("dataset /reference/error: allowed are numbers from 0")


def _read_strategy(file, name, measured, breaks):
    path = f"strategies/{name}"
    if not isinstance(file.get(path), h5py.Group):
        raise ValueError(f"group /{path}: missing")
    attributes = _read_attributes(file[path], ("name", "rtol", "complaint", "first_difference", "n_p", "n_f", "memory"))
    series = {one: array(file, f"{path}/{one}", np.int64 if one == "iterations" else np.float64,
                         2 if one in ("time", "phase") else 1) for one in SERIES}
    _check_series(path, series, measured)
    rtol = attributes["rtol"]
    try:
        tolerance = float(rtol) if rtol else np.nan
    except ValueError as error:
        raise ValueError(f"attribute rtol of /{path}: {rtol}; it must be a number") from error
    family = attributes["name"][:-len(rtol)].strip() if rtol else attributes["name"]
    return Strategy(attributes["name"], family, tolerance, attributes, series, breaks)


def _check_series(path, series, measured):
    repetitions = len(series["total"])
    if series["time"].shape != (repetitions, measured) or series["phase"].shape != (repetitions, len(PHASES)):
        raise ValueError(f"datasets time and phase of /{path}: they must have {repetitions} rows, of {measured} and "
                         f"{len(PHASES)} columns")
    same_length({f"{path}/set_up": series["set_up"]}, repetitions)
    same_length({f"{path}/{name}": series[name] for name in ("iterations", *ERRORS)}, measured)
    for name in (*TIMES, *ERRORS):  # a comparison with NaN, which stands for "not reached", is False
        if np.any(series[name] < 0) or np.isinf(series[name]).any():
            raise ValueError(f"dataset /{path}/{name}: allowed are finite numbers from 0")
    if np.any(series["iterations"] < -1):
        raise ValueError(f"dataset /{path}/iterations: allowed are numbers from -1")
