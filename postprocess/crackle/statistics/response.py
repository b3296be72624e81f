"""How a sample answers the machine that pulls at it.

The response is the points (displacement P_k/F_k, load P_k) of all breaks k, in order; it jumps back and
forth, because the load is let off as far as it takes for a single bond to break. Its envelope is what a
machine measures that only ever increases the displacement: at displacement u the network has made all
breaks before the first break k whose displacement P_k/F_k exceeds u, and carries F_k u. So the load climbs
with slope F_k, and drops at constant displacement when bonds break; breaks below the largest displacement
so far belong to the avalanche of an earlier one. The peak load is always on the envelope.
"""
import numpy as np


def envelope(load, stiffness, failed):
    """The load carried while the displacement only increases: corners (displacement, load) of the curve.

    load, stiffness: float64[B], P_k and F_k of every break. failed: nothing carries load after the last
    break; otherwise the curve ends where the last bond but broke.
    """
    displacement = load / stiffness
    largest = np.concatenate([[0.0], np.maximum.accumulate(displacement)])
    reached = np.flatnonzero(displacement > largest[:-1])  # breaks that begin an avalanche
    start = largest[reached]                               # where the avalanche before left the displacement
    u = np.stack([start, displacement[reached]], axis=1).ravel()
    p = np.stack([stiffness[reached] * start, load[reached]], axis=1).ravel()
    return (np.append(u, u[-1]), np.append(p, 0.0)) if failed and len(u) else (u, p)
