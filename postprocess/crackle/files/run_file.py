"""Reads the run files of crackle, also while the run goes on.

    from crackle.files import read_run
    run = read_run("crackle.h5")
    print(run.options["-lattice_size"], run.peak_load.mean())
    breaks = run.breaks(0)                  # the first sample in the file
    displacement = breaks.load / breaks.stiffness

Units: lengths in lattice spacings along x, forces in bond stiffness x lattice spacing. In a fuse network load
means current and displacement means voltage.
"""
import glob
import os
from dataclasses import dataclass, field
from typing import Optional

import h5py
import numpy as np

from crackle.files.hdf5_file import array, check_version, has, number, open_file, read_options, same_length, text
from crackle.files.run_checks import check_breaks, check_network, check_profiles, check_samples, check_snapshots

SCHEMA_VERSIONS = (1, 2)  # 2: with checksums
SAMPLE_FIELDS = {"index": np.int64, "peak_load": np.float64, "peak_displacement": np.float64, "n_p": np.int32,
                 "n_f": np.int32, "initial_stiffness": np.float64, "wall_time": np.float64}
BREAK_FIELDS = {"bond": np.int32, "load": np.float64, "stiffness": np.float64}
SNAPSHOT_FIELDS = {"sample": (np.int64, 1), "number": (np.int32, 1), "displacement": (np.float64, 2),
                   "force": (np.float64, 2)}
# Files of schema 1 don't say which of their options decide results.
DECIDING_OF_OLD = ("-model", "-lattice", "-lattice_size", "-lattice_row_spacing", "-lattice_file", "-lattice_dilution",
                 "-stiffness", "-stiffness_contrast", "-grips", "-break_on", "-disorder", "-disorder_exponent",
                 "-disorder_zero_share", "-seed", "-stop")


@dataclass
class Breaks:
    """The breaks of one sample, in order; arrays of length n_f."""
    bond: np.ndarray       # int32, bond number
    load: np.ndarray       # float64, P_k, the load at which it broke
    stiffness: np.ndarray  # float64, F_k, plate force at unit plate displacement just before it broke


@dataclass
class Snapshot:
    """A network just before a break, at the load of that break."""
    number: int               # of the break, from 1
    displacement: np.ndarray  # float64[N * components], node by node
    force: np.ndarray         # float64[M], 0 for broken bonds


@dataclass
class Network:
    """The intact network: N nodes, M bonds."""
    positions: np.ndarray            # float64[N, 2]
    grip: np.ndarray                 # int8[N]: 0 free, 1 bottom, 2 top
    bonds: np.ndarray                # int32[M, 2], first and second node
    stiffness: np.ndarray            # float64[M]
    threshold: Optional[np.ndarray]  # float64[M], or [S, M] by sample number; None unless the file gives them
    components: int                  # 1 fuse, 2 spring
    period_x: float                  # 0: not periodic
    step: Optional[np.ndarray] = None  # float64[M, 2], from the first node to the second; None: to its nearest image

    def segments(self):
        """Ends of every bond, float64[M, 2, 2]: the first node and, in x, the image of the second that is meant."""
        first = self.positions[self.bonds[:, 0]]
        if self.step is not None:
            return np.stack([first, first + self.step], axis=1)
        step = self.positions[self.bonds[:, 1]] - first
        if self.period_x > 0:
            step[:, 0] -= self.period_x * np.ceil(step[:, 0] / self.period_x - 0.5)
        return np.stack([first, first + step], axis=1)


@dataclass
class Run:
    """S samples, ordered by sample number."""
    path: str
    options: dict                  # "-name" to value, both as text
    index: np.ndarray              # int64[S], sample number
    peak_load: np.ndarray          # float64[S]
    peak_displacement: np.ndarray  # float64[S]
    n_p: np.ndarray                # int32[S], bonds broken up to and including the one at the peak load
    n_f: np.ndarray                # int32[S], all that broke
    initial_stiffness: np.ndarray  # float64[S], plate force at unit plate displacement, nothing broken
    wall_time: np.ndarray          # float64[S], seconds
    _breaks: Optional[list]        # of Breaks, by position in the arrays above; None if not recorded
    _network: Optional[Network]
    _snapshots: dict = field(default_factory=dict)  # sample number to list of Snapshot
    deciding: tuple = ()                            # names of the options that decide results
    numbers: dict = field(default_factory=dict)     # "group/name" to float64[S]: -record energy has energy/stored

    def __len__(self):
        return len(self.index)

    def find(self, sample):
        """Where the sample of that number stands in the arrays."""
        found = np.flatnonzero(self.index == sample)
        if not len(found):
            held = f"{self.index[0]} to {self.index[-1]}" if len(self) else "none"
            raise ValueError(f"{self.path}: no sample {sample} (samples: {held})")
        return int(found[0])

    @property
    def has_breaks(self):
        """False for a run with -record none."""
        return self._breaks is not None

    def breaks(self, s):
        """The breaks of the s-th sample in the file (not of sample number s: see find)."""
        if self._breaks is None:
            raise ValueError(f"{self.path}: no /breaks (run with -record breaks)")
        return self._breaks[s]

    def snapshots(self, s):
        """The s-th sample's Snapshots, by break number; none unless it was run with -record snapshot."""
        return self._snapshots.get(int(self.index[s]), [])

    def network(self):
        """The intact network, from the file or rebuilt from the options; None if neither gives it."""
        plain = (self.options.get("-lattice") == "triangular" and self.options.get("-stiffness", "uniform") == "uniform"
                 and float(self.options.get("-lattice_dilution", "0")) == 0)
        if self._network is None and plain:
            self._network = triangular_network(int(self._option("-lattice_size")),
                                               float(self._option("-lattice_row_spacing")),
                                               components=1 if self._option("-model") == "fuse" else 2)
        return self._network

    def _option(self, name):
        if name not in self.options:
            raise ValueError(f"{self.path}: the option {name} is not among those stored")
        return self.options[name]


def read_run(path):
    """Reads a run file, and the finished samples that a run still going on keeps in PATH.shards/N.h5.

    Everything is read into memory and the files are closed again. Samples are ordered by number, each once.
    Raises ValueError, in one line, if the file is missing, damaged, of another kind or of another schema, or holds what
    can't be true of a run.
    """
    path = os.fspath(path)
    # Shards first: one that the run merges away meanwhile is then in the run file, which is read after it.
    shards = sorted(shard for shard in glob.glob(glob.escape(path) + ".shards/*.h5")
                     if os.path.basename(shard)[:-3].isdigit())  # what else lies there is none of ours
    parts = [part for part in (_read_part(shard, may_vanish=True) for shard in shards) if part]
    main = _read_part(path, may_vanish=bool(parts))
    if main:
        parts.insert(0, main)
    for part in parts[1:]:
        _check_same_scene(parts[0], part)
    return _merge(path, parts)


def triangular_network(size, row_spacing, components):
    """size + 1 rows of size + 1 nodes, periodic in x, odd rows shifted by 1/2; stiffness 1.

    Bonds are numbered node by node, row by row upwards: the horizontal bond, then, but for the top row, the
    one up to the right and the one up to the left.
    """
    width = size + 1
    row, column = np.divmod(np.arange(width * width), width)
    shift = row % 2
    second = np.stack([row * width + (column + 1) % width,
                       (row + 1) * width + (column + shift) % width,
                       (row + 1) * width + (column + shift + size) % width], axis=1)
    exists = np.ones_like(second, dtype=bool)
    exists[row == size, 1:] = False
    first = np.broadcast_to(np.arange(width * width)[:, None], second.shape)
    bonds = np.stack([first[exists], second[exists]], axis=1).astype(np.int32)
    return Network(positions=np.stack([column + 0.5 * shift, row * row_spacing], axis=1),
                   grip=np.where(row == 0, 1, np.where(row == size, 2, 0)).astype(np.int8),
                   bonds=bonds, stiffness=np.ones(len(bonds)), threshold=None,
                   components=components, period_x=float(width))


@dataclass
class _Part:
    """What one file holds."""
    path: str
    options: dict
    samples: dict  # field name to array[S]
    breaks: Optional[list]
    network: Optional[Network]
    snapshots: dict
    profiles: Optional[tuple]
    numbers: dict  # "group/name" to array[S]
    deciding: tuple  # names of the options that decide results


def _read_part(path, may_vanish):
    """One file. None if it does not exist and may_vanish."""
    if not os.path.lexists(path):
        if may_vanish:
            return None
        raise ValueError(f"{path}: no such file")
    if not os.path.isfile(path):  # a pipe would never answer
        raise ValueError(f"{path}: no plain file")
    try:
        with open_file(path) as file:
            return _read_file(path, file)
    except FileNotFoundError:
        return _read_part(path, may_vanish)


def _read_file(path, file):
    if "schema_version" not in file.attrs or "options" not in file.attrs:
        raise ValueError("not a run file of crackle")
    check_version(file, SCHEMA_VERSIONS)
    options = read_options(file)
    if not has(file, "samples"):
        raise ValueError("group /samples: missing")
    samples = {name: array(file, f"samples/{name}", kind, 1) for name, kind in SAMPLE_FIELDS.items()}
    same_length({f"samples/{name}": values for name, values in samples.items()}, len(samples["index"]))
    check_samples(samples)
    network = _read_network(file)
    size = _sizes(file, options, network)
    return _Part(path, options, samples, _read_breaks(file, options, samples, size["force"]), network,
                 _read_snapshots(file, options, samples, size), _read_profiles(file, options, samples),
                 _read_numbers(file, samples), _read_deciding(file))


def _read_numbers(file, samples):
    """Of parts that keep numbers of each sample, "group/name" to float64[S]: every other group of such datasets."""
    found = {}
    for group in set(file) - {"samples", "breaks", "profile", "snapshots", "network"}:
        if isinstance(file.get(group), h5py.Group):
            found.update({f"{group}/{name}": array(file, f"{group}/{name}", np.float64, 1) for name in file[group]})
    same_length({"samples/index": samples["index"], **found}, len(samples["index"]))
    return found


def _read_deciding(file):
    """Names of the options that decide results."""
    if "deciding_options" not in file.attrs:
        return DECIDING_OF_OLD
    return tuple(text(file, "deciding_options").splitlines())


def _sizes(file, options, network):
    """How many numbers a displacement and a force of the whole network are; None where that isn't known."""
    if network is not None:
        return {"displacement": network.positions.shape[0] * network.components, "force": len(network.bonds)}
    bonds, numbers = int(number(file, "bonds")) if "bonds" in file.attrs else None, None
    if options.get("-lattice") == "triangular" and "-lattice_size" in options:
        size = int(options["-lattice_size"])
        numbers = (size + 1) ** 2 * (1 if options.get("-model") == "fuse" else 2)
        if bonds is None and float(options.get("-lattice_dilution", "0")) == 0:
            bonds = (size + 1) * (3 * size + 1)
    return {"displacement": numbers, "force": bonds}


def _recorded(file, options, group, word):
    """Whether the file has the group that -record WORD asks for. Raises ValueError when it should and hasn't."""
    if word in options.get("-record", "").split(",") and not has(file, group):
        raise ValueError(f"group /{group}: missing, though the run was made with -record {word}")
    return has(file, group)


def _read_breaks(file, options, samples, bonds):
    """A list of Breaks, one per sample; None if the file holds no /breaks."""
    if not _recorded(file, options, "breaks", "breaks"):
        return None
    breaks = {name: array(file, f"breaks/{name}", kind, 1) for name, kind in BREAK_FIELDS.items()}
    same_length({f"breaks/{name}": values for name, values in breaks.items()}, len(breaks["bond"]))
    offset = array(file, "samples/break_offset", np.int64, 1)
    check_breaks(samples, offset, breaks, bonds)
    return [Breaks(*(values[begin:end] for values in breaks.values())) for begin, end in zip(offset[:-1], offset[1:])]


def _read_network(file):
    """The group /network, None if the file holds none."""
    if not has(file, "network"):
        return None
    group = file["network"]
    if not isinstance(group, h5py.Group):
        raise ValueError("group /network: it is a dataset")
    nodes = array(file, "network/bonds/nodes", np.int32, 2)
    rows = {"stiffness": 1, "step": 2,
            "threshold": 2 if getattr(file.get("network/bonds/threshold"), "ndim", 1) == 2 else 1}
    optional = {name: array(file, f"network/bonds/{name}", np.float64, rank)
                for name, rank in rows.items() if has(file, f"network/bonds/{name}")}
    network = Network(array(file, "network/nodes/position", np.float64, 2), array(file, "network/nodes/grip", np.int8, 1),
                      nodes, optional.get("stiffness", np.ones(len(nodes))), optional.get("threshold"),
                      int(number(group, "components")), float(number(group, "period_x")),
                      optional.get("step"))
    check_network(network)
    return network


def _read_profiles(file, options, samples):
    """Broken bonds by section, up to the peak load and to failure: int32[S, sections] each; None if not recorded."""
    if not _recorded(file, options, "profile", "profile"):
        return None
    peak, failure = (array(file, f"profile/{name}", np.int32, 2) for name in ("peak", "failure"))
    check_profiles(samples, peak, failure)
    return peak, failure


def _read_snapshots(file, options, samples, columns):
    """Sample number to its Snapshots."""
    found = {}
    if not _recorded(file, options, "snapshots", "snapshot"):
        return found
    rows = {name: array(file, f"snapshots/{name}", *kind) for name, kind in SNAPSHOT_FIELDS.items()}
    same_length({f"snapshots/{name}": values for name, values in rows.items()}, len(rows["sample"]))
    asked = options.get("-record_snapshot_at")
    check_snapshots(samples, rows, set(map(int, asked.split(","))) if asked else None, columns)
    for sample, at, displacement, force in zip(*rows.values()):
        found.setdefault(int(sample), []).append(Snapshot(int(at), displacement, force))
    return found


def _check_same_scene(one, other):
    for name in sorted({*one.deciding, *other.deciding}):
        value, other_value = one.options.get(name), other.options.get(name)
        if value != other_value:
            raise ValueError(f"{other.path}: not of the same run as {one.path}: "
                             f"{name} {other_value}, not {value}")


def _merge(path, parts):
    """All samples of all parts, by number; of samples with the same number the first part's."""
    samples = {name: np.concatenate([part.samples[name] for part in parts]) for name in SAMPLE_FIELDS}
    _, order = np.unique(samples["index"], return_index=True)
    breaks = None
    filled = [part for part in parts if len(part.samples["index"])]
    if all(part.breaks is not None for part in filled or parts):
        together = [breaks_of_one for part in filled for breaks_of_one in part.breaks]
        breaks = [together[s] for s in order]
    network = next((part.network for part in parts if part.network is not None), None)
    numbers = {name: np.concatenate([part.numbers[name] for part in parts])[order]
               for name in set.intersection(*(set(part.numbers) for part in parts))}
    return Run(path, parts[0].options, **{name: array[order] for name, array in samples.items()},
               _breaks=breaks, _network=network,
               _snapshots={sample: list_of_one for part in reversed(parts)
                           for sample, list_of_one in part.snapshots.items()}, deciding=parts[0].deciding, numbers=numbers)
