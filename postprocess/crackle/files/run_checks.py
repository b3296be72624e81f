"""What can't be true of a run: the checks by which a run file is refused. All raise ValueError naming dataset, value and
sample.
"""
import numpy as np

LAST_INDEX = 2**63 - 2  # of a sample: one more can still be counted
# Peak displacement and initial stiffness follow from the breaks; so much may differ, by another way of rounding.
ROUNDING = 1e-9


def refuse(bad, name, values, index, allowed):
    """Raises ValueError for the first of `values` that is bad; index: the sample number of each."""
    if np.any(bad):
        at = int(np.flatnonzero(bad)[0])
        raise ValueError(f"dataset /{name}: {values[at]} of sample {index[at]}; allowed is {allowed}")


def check_samples(samples):
    """samples: name to array[S]."""
    index = samples["index"]
    refuse((index < 0) | (index > LAST_INDEX), "samples/index", index, index, f"0 to {LAST_INDEX}")
    refuse(np.append(False, np.diff(index) <= 0), "samples/index", index, index, "more than that of the one before")
    n_p, n_f = samples["n_p"], samples["n_f"]
    refuse(n_f < 0, "samples/n_f", n_f, index, "0 or more")
    refuse((n_p < np.minimum(n_f, 1)) | (n_p > n_f), "samples/n_p", n_p, index, "1 to n_f")
    for name in ("peak_load", "peak_displacement", "wall_time", "initial_stiffness"):
        values = samples[name]
        refuse(~np.isfinite(values) | (values < 0), f"samples/{name}", values, index, "a finite number from 0")


def check_offset(offset, samples, breaks):
    """samples: name to array[S]; breaks: how many there are in all."""
    name = "dataset /samples/break_offset"
    if len(offset) != len(samples["index"]) + 1:
        raise ValueError(f"{name}: {len(offset)} places; there must be {len(samples['index']) + 1}")
    if offset[0] != 0 or np.any(np.diff(offset) < 0) or offset[-1] != breaks:
        raise ValueError(f"{name}: it must ascend from 0 to {breaks}, the number of breaks")
    refuse(np.diff(offset) != samples["n_f"], "samples/n_f", samples["n_f"], samples["index"],
           "the number of its breaks")


def check_breaks(samples, offset, breaks, bonds):
    """breaks: name to array[B]; bonds: how many the network has, None if that isn't known."""
    check_offset(offset, samples, len(breaks["bond"]))
    bond, load, stiffness = breaks["bond"], breaks["load"], breaks["stiffness"]
    owner = np.repeat(np.arange(len(offset) - 1), np.diff(offset))
    index = samples["index"][owner]
    limit = bonds if bonds is not None else 2**31 - 1
    refuse((bond < 0) | (bond >= limit), "breaks/bond", bond, index, f"0 to {limit - 1}")
    key = owner.astype(np.int64) << 32 | bond
    if np.any(np.diff(np.sort(key)) == 0):
        again = np.setdiff1d(np.arange(len(key)), np.unique(key, return_index=True)[1])
        refuse(np.ones(1, bool), "breaks/bond", bond[again], index[again], "a bond that isn't broken yet")
    refuse(~np.isfinite(load) | (load < 0), "breaks/load", load, index, "a finite number from 0")
    refuse(~np.isfinite(stiffness) | (stiffness <= 0), "breaks/stiffness", stiffness, index, "a finite number above 0")
    _check_peaks(samples, offset, load, stiffness)


def _check_peaks(samples, offset, load, stiffness):
    """Peak and initial stiffness are those of the breaks."""
    begun = samples["n_f"] > 0
    if not begun.any():
        return
    begin, index = offset[:-1][begun], samples["index"][begun]
    of_breaks = {name: samples[name][begun] for name in samples}
    peak = begin + of_breaks["n_p"] - 1
    largest = np.maximum.reduceat(load, begin)  # only samples without breaks are left out, so the pieces are whole
    refuse(of_breaks["peak_load"] != largest, "samples/peak_load", of_breaks["peak_load"], index, "its largest load")
    refuse(load[peak] != largest, "samples/n_p", of_breaks["n_p"], index, "the break at the peak load")
    for name, expected, allowed in (("peak_displacement", load[peak] / stiffness[peak], "peak load by stiffness there"),
                                    ("initial_stiffness", stiffness[begin], "the stiffness before the first break")):
        differs = ~np.isclose(of_breaks[name], expected, rtol=ROUNDING, atol=0)
        refuse(differs, f"samples/{name}", of_breaks[name], index, allowed)


def check_profiles(samples, peak, failure):
    """Broken bonds by section: [S][sections]."""
    if peak.shape != failure.shape or len(peak) != len(samples["index"]):
        raise ValueError(f"datasets /profile/peak and /profile/failure: {len(peak)} and {len(failure)} rows; "
                         f"there must be one for each of {len(samples['index'])} samples, equally long")
    for name, counts, total in (("peak", peak, samples["n_p"]), ("failure", failure, samples["n_f"])):
        refuse((counts < 0).any(axis=1), f"profile/{name}", counts.min(axis=1, initial=0), samples["index"], "0 or more")
        sums = counts.sum(axis=1, dtype=np.int64)
        refuse(sums != total, f"profile/{name}", sums, samples["index"], "as many broken bonds as in /samples")


def check_snapshots(samples, snapshots, asked, columns):
    """snapshots: name to array[K], [K][..]; asked: break numbers at which there must be one, None if not known;
    columns: how many displacement and force must have, where that is known.
    """
    owner, at = snapshots["sample"], snapshots["number"]
    place = np.searchsorted(samples["index"], owner)
    known = place < len(samples["index"])
    known[known] = samples["index"][place[known]] == owner[known]
    refuse(~known, "snapshots/sample", owner, owner, "a sample of the file")
    refuse((at < 1) | (at > samples["n_f"][place]), "snapshots/number", at, owner, "1 to n_f")
    pairs = list(zip(owner.tolist(), at.tolist()))
    if len(set(pairs)) != len(pairs):
        raise ValueError("dataset /snapshots/number: a break of a sample twice")
    for name in ("displacement", "force"):
        refuse(~np.isfinite(snapshots[name]).all(axis=1), f"snapshots/{name}", at, owner, "finite numbers")
    for name, width in columns.items():
        if len(at) and width is not None and snapshots[name].shape[1] != width:
            raise ValueError(f"dataset /snapshots/{name}: {snapshots[name].shape[1]} columns; it must have {width}")
    if asked is not None:
        expected = sum(int(np.count_nonzero(samples["n_f"] >= number)) for number in asked)
        if expected != len(pairs):
            raise ValueError(f"datasets of /snapshots: {len(pairs)} snapshots; -record_snapshot_at asks for {expected}")


def check_network(network):
    """A run_file.Network: sizes, node numbers, grips."""
    nodes, bonds = len(network.positions), len(network.bonds)
    if network.positions.shape[1:] != (2,) or network.bonds.shape[1:] != (2,):
        raise ValueError("datasets /network/nodes/position and /network/bonds/nodes: they must have two columns")
    if network.components not in (1, 2) or not 0 <= network.period_x < np.inf:
        raise ValueError("attributes of /network: components must be 1 or 2, period_x a number from 0")
    if len(network.grip) != nodes or not np.isin(network.grip, (0, 1, 2)).all():
        raise ValueError(f"dataset /network/nodes/grip: it must have 0, 1 or 2 for each of {nodes} nodes")
    if bonds and (network.bonds.min() < 0 or network.bonds.max() >= nodes):
        raise ValueError(f"dataset /network/bonds/nodes: a node other than 0 to {nodes - 1}")
    if not np.isfinite(network.positions).all():
        raise ValueError("dataset /network/nodes/position: it must have finite numbers")
    if network.step is not None and (network.step.shape != (bonds, 2) or not np.isfinite(network.step).all()):
        raise ValueError(f"dataset /network/bonds/step: it must have two finite numbers for each of {bonds} bonds")
    for name, values in (("stiffness", network.stiffness), ("threshold", network.threshold)):
        if values is None:
            continue
        if values.shape[-1] != bonds or not (values >= 0).all() or (name == "stiffness" and np.isinf(values).any()):
            raise ValueError(f"dataset /network/bonds/{name}: it must have a number from 0 for each of {bonds} bonds")
