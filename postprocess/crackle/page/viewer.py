"""What the crack viewer of the page draws: one sample of each of a few ensembles, as JSON with packed arrays."""
import base64

import numpy as np

from crackle.figures.sample import LABELS, TAIL
from crackle.statistics.response import envelope

LARGEST = 128         # lattice size that browsers draw smoothly
SIZES_OF_A_MODEL = 2


def viewer_samples(study):
    """A list of dictionaries for viewer.js: the largest sizes of every model that are smooth, their typical samples."""
    chosen = []
    for model in study.models:
        recorded = [e for e in study.of(model) if e.recorded and e.run.n_f[e.typical()] > 0]
        smooth = [e for e in recorded if e.size <= LARGEST] or recorded[:1]
        chosen += reversed(smooth[-SIZES_OF_A_MODEL:])
    return [_one_sample(ensemble) for ensemble in chosen]


def _one_sample(ensemble):
    s = ensemble.typical()
    breaks, network = ensemble.run.breaks(s), ensemble.network
    displacement = breaks.load / breaks.stiffness
    peak = int(ensemble.run.n_p[s])
    load_label, displacement_label = (label.replace("$", "") for label in LABELS[ensemble.model])
    corner_u, corner_p = envelope(breaks.load, breaks.stiffness, ensemble.failed)
    return {"name": f"{ensemble.model}, L = {ensemble.size}, sample {ensemble.run.index[s]}",
            "peak": peak, "period": network.period_x, "tail": TAIL * float(displacement[peak - 1]),
            "loadLabel": load_label, "displacementLabel": displacement_label,
            "positions": _pack(network.positions, "<f4"), "bonds": _pack(network.bonds, "<i4"),
            "broken": _pack(breaks.bond, "<i4"), "load": _pack(breaks.load, "<f4"),
            "displacement": _pack(displacement, "<f4"),
            "envelope": _pack(np.stack([corner_u, corner_p], axis=1), "<f4")}


def _pack(values, kind):
    """Little-endian bytes in base64."""
    return base64.b64encode(np.ascontiguousarray(values, dtype=kind).tobytes()).decode()
