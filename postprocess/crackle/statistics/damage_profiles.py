"""Damage profiles across the sample: p(y) = n_b(y) / (N / sections), for a triangular lattice n_b(y) / (3L+1).

n_b(y) counts the broken bonds of row section y: a row of nodes with the bonds that rise from it, as
`-record profile` counts them. Localisation may happen anywhere along y, so profiles are shifted by the centre of mass
of their damage before they are averaged; or the magnitudes of their Fourier transforms are averaged, which no
shift can bias.
"""
import numpy as np

ROW_ROUNDING = 1e-9  # share of a section by which rounding may put a row below its own height


def bond_sections(network, row_spacing=1.0):
    """The row section of every bond: int[M], that of its lower node."""
    height = network.positions[:, 1] - network.positions[:, 1].min()
    lower = height[network.bonds].min(axis=1)
    return np.floor(lower / row_spacing + ROW_ROUNDING).astype(int)


def section_counts(bonds, section, sections):
    """n_b(y) of the broken bonds given: int[sections]."""
    return np.bincount(section[bonds], minlength=sections)


def centres_of_mass(counts):
    """Mean section of the broken bonds of every sample; nan where none is broken. counts: [S, sections]."""
    counts = np.asarray(counts, dtype=float)
    with np.errstate(invalid="ignore", divide="ignore"):
        return counts @ np.arange(counts.shape[1]) / counts.sum(axis=1)


def centred(counts):
    """Profiles shifted, by whole sections, so that the centre of mass stands in the middle: float[S, sections].

    y is not periodic: where a shifted profile has no section, it is nan and counts in no average.
    """
    counts = np.asarray(counts, dtype=float)
    samples, sections = counts.shape
    middle = (sections - 1) / 2
    centre = centres_of_mass(counts)
    shift = np.round(np.where(np.isnan(centre), middle, centre) - middle).astype(int)
    source = np.arange(sections)[None, :] + shift[:, None]
    inside = (source >= 0) & (source < sections)
    shifted = np.take_along_axis(counts, np.clip(source, 0, sections - 1), axis=1)
    shifted[~inside] = np.nan
    return shifted


def average_profile(shifted, weights):
    """Mean over samples of what is there, for every row of weights [R, S]: float[R, sections].

    nan where fewer than half the samples reach: there an average would be over other samples than in the middle.
    """
    there = np.isfinite(shifted)
    reached = weights @ there
    with np.errstate(invalid="ignore", divide="ignore"):
        mean = weights @ np.where(there, shifted, 0.0) / reached
    mean[:, there.mean(axis=0) < 0.5] = np.nan
    return mean


def fourier_magnitudes(counts):
    """|sum over y of n_b(y) exp(-2 pi i q y / sections)| / sum of n_b, q = 1, 2, ...: float[S, sections // 2].

    0 for uniform damage, 1 for damage in a single section; samples without damage are left out.
    """
    counts = np.asarray(counts, dtype=float)
    counts = counts[counts.sum(axis=1) > 0]
    return np.abs(np.fft.rfft(counts, axis=1))[:, 1:] / counts.sum(axis=1, keepdims=True)


def uncorrelated_magnitude(broken):
    """What fourier_magnitudes gives on average for `broken` bonds broken anywhere, independently: sqrt(pi/n)/2.

    A random walk of n unit steps ends sqrt(pi n)/2 away on average (Rayleigh).
    """
    return np.sqrt(np.pi / broken) / 2


def segment_counts(bonds, peak, section, sections, segments=6):
    """n_b(y) within segments of equally many breaks: up to the peak [segments, sections], and after it.

    bonds: int[B] in the order of breaking; peak: how many of them broke up to and including the peak load.
    """
    parts = [np.array_split(bonds[:peak], segments), np.array_split(bonds[peak:], segments)]
    return [np.stack([section_counts(part, section, sections) for part in side]) for side in parts]
