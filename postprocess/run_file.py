"""Reads the run files of crackle, also while the run goes on.

    from run_file import read_run
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

SCHEMA_VERSION = 1
SAMPLE_FIELDS = ("index", "peak_load", "peak_displacement", "n_p", "n_f", "initial_stiffness", "wall_time")
BREAK_FIELDS = ("bond", "load", "stiffness")
# Samples belong together only if these agree; the others may change when a run is resumed.
SCENE_OPTIONS = ("-model", "-lattice", "-lattice_size", "-lattice_row_spacing", "-lattice_file", "-lattice_dilution",
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
    threshold: Optional[np.ndarray]  # float64[M], None unless the file gives them
    components: int                  # 1 fuse, 2 spring
    period_x: float                  # 0: not periodic

    def segments(self):
        """Ends of every bond, float64[M, 2, 2]: the first node and the nearest image in x of the second."""
        first = self.positions[self.bonds[:, 0]]
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
    """Reads a run file, and the finished samples that a run still going on keeps in PATH.shards/*.h5.

    Everything is read into memory and the files are closed again. Samples are ordered by number, each once.
    Raises ValueError, in one line, if the file is missing, truncated, of another kind or of another schema.
    """
    path = os.fspath(path)
    # Shards first: one that the run merges away meanwhile is then in the run file, which is read after it.
    shards = sorted(glob.glob(glob.escape(path) + ".shards/*.h5"))
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


def _read_part(path, may_vanish):
    """One file. None if it does not exist and may_vanish."""
    if not os.path.isfile(path):
        if may_vanish:
            return None
        raise ValueError(f"{path}: no such file")
    try:
        with h5py.File(path, "r") as file:
            _check_kind(path, file)
            samples = {name: file["samples"][name][...] for name in SAMPLE_FIELDS}
            return _Part(path, _read_options(file.attrs["options"]), samples,
                         _read_breaks(file, len(samples["index"])), _read_network(file), _read_snapshots(file))
    except FileNotFoundError:
        return _read_part(path, may_vanish)
    except (OSError, RuntimeError) as error:  # what h5py raises for damaged files
        reason = "truncated" if "truncated" in str(error) else "not an HDF5 file, or damaged"
        if isinstance(error, (PermissionError, BlockingIOError)):
            reason = error.args[-1]
        raise ValueError(f"{path}: {reason}") from error
    except KeyError as error:
        raise ValueError(f"{path}: incomplete run file: {error.args[0]}") from error


def _check_kind(path, file):
    if "schema_version" not in file.attrs or "options" not in file.attrs or "samples" not in file:
        raise ValueError(f"{path}: not a run file of crackle")
    version = int(np.ravel(file.attrs["schema_version"])[0])
    if version != SCHEMA_VERSION:
        raise ValueError(f"{path}: schema version {version}; this module reads {SCHEMA_VERSION}")


def _read_options(text):
    """One `-name value` per line; an option without a value gets an empty one."""
    text = np.ravel(text)[0] if isinstance(text, np.ndarray) else text
    text = text.decode() if isinstance(text, bytes) else text
    options = {}
    for line in filter(None, map(str.strip, text.splitlines())):
        name, _, value = line.partition(" ")
        options[name] = value.strip()
    return options


def _read_breaks(file, samples):
    """A list of Breaks, one per sample; None if the file holds no /breaks."""
    if "breaks" not in file:
        return None
    arrays = [file["breaks"][name][...] for name in BREAK_FIELDS]
    offset = file["samples"]["break_offset"][...]
    if len(offset) != samples + 1 or np.any(np.diff(offset) < 0) or any(len(a) != offset[-1] for a in arrays):
        raise ValueError(f"{file.filename}: /samples/break_offset does not fit /breaks")
    return [Breaks(*(array[begin:end] for array in arrays)) for begin, end in zip(offset[:-1], offset[1:])]


def _read_network(file):
    """The group /network, None if the file holds none."""
    if "network" not in file:
        return None
    group = file["network"]
    bonds = group["bonds"]
    nodes = bonds["nodes"][...]
    stiffness = bonds["stiffness"][...] if "stiffness" in bonds else np.ones(len(nodes))
    threshold = bonds["threshold"][...] if "threshold" in bonds else None
    return Network(group["nodes/position"][...], group["nodes/grip"][...], nodes, stiffness, threshold,
                   int(np.ravel(group.attrs["components"])[0]), float(np.ravel(group.attrs["period_x"])[0]))


def _read_snapshots(file):
    """Sample number to its Snapshots."""
    found = {}
    if "snapshots" not in file:
        return found
    group = file["snapshots"]
    displacement, force = group["displacement"][...], group["force"][...]
    for row, (sample, number) in enumerate(zip(group["sample"][...], group["number"][...])):
        found.setdefault(int(sample), []).append(Snapshot(int(number), displacement[row], force[row]))
    return found


def _check_same_scene(one, other):
    for name in SCENE_OPTIONS:
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
    return Run(path, parts[0].options, **{name: array[order] for name, array in samples.items()},
               _breaks=breaks, _network=network,
               _snapshots={sample: list_of_one for part in reversed(parts)
                           for sample, list_of_one in part.snapshots.items()})
