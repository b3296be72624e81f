"""Many runs together: which models and sizes there are, and what follows from their samples.

    from crackle.study import read_study
    study = read_study(["spring_8.h5", "spring_16.h5", "fuse_8.h5"])
    for ensemble in study.of("spring"):
        print(ensemble.size, ensemble.strength.mean())
"""
import glob
import os
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from crackle.files.run_file import read_run
from crackle.statistics.avalanches import avalanche_sizes, size_counts
from crackle.statistics.bootstrap import RESAMPLES, resampling_weights, weighted_means
from crackle.statistics.damage_profiles import bond_sections, section_counts

MODELS = ("spring", "fuse")
FREE_OPTIONS = ("-model", "-lattice_size", "-seed")  # in these, runs of one study may differ
# what breaks the same bonds, or keeps more of them
FREE_STARTS = ("-equilibrium", "-ksp_", "-pc_", "-mat_", "-record", "-checkpoint_", "-ensemble_")


class Missing(ValueError):
    """What was asked for can't be made from the runs there are; the text says why."""


@dataclass(eq=False)
class Ensemble:
    """All samples of one model at one size."""
    model: str
    size: int
    runs: list  # of Run: several of them have other seeds or other sample numbers
    resamples: int = RESAMPLES

    @property
    def run(self):
        """The first run: its samples are those that are drawn one by one."""
        return self.runs[0]

    @cached_property
    def network(self):
        return self.run.network()

    @property
    def bonds(self):
        """N_el, (3L+1)(L+1) for a triangular lattice."""
        return len(self.network.bonds)

    @property
    def sections(self):
        return int(self.section.max()) + 1

    @property
    def bonds_per_section(self):
        """What damage profiles are divided by: 3L+1 for a triangular lattice."""
        return self.bonds / self.sections

    def _all(self, name):
        return np.concatenate([getattr(run, name) for run in self.runs])

    @cached_property
    def peak_load(self):
        return self._all("peak_load")

    @property
    def strength(self):
        """sigma_f = peak load / L."""
        return self.peak_load / self.size

    @cached_property
    def n_p(self):
        return self._all("n_p").astype(int)

    @cached_property
    def n_f(self):
        return self._all("n_f").astype(int)

    @property
    def last_avalanche(self):
        """s_m = n_f - n_p."""
        return self.n_f - self.n_p

    @property
    def failed(self):
        """Samples were broken up to failure: n_f means what the name says."""
        return all(run.options.get("-stop", "failure") == "failure" for run in self.runs)

    def __len__(self):
        return len(self.peak_load)

    @cached_property
    def weights(self):
        """Of the bootstrap over samples; other ensembles have other ones."""
        seed = [self.size, *self.model.encode()]
        return resampling_weights(len(self), self.resamples, seed)

    def resampled_mean(self, values):
        return weighted_means(self.weights, values)

    @cached_property
    def recorded(self):
        return all(run.has_breaks for run in self.runs)

    def _each_sample(self):
        if not self.recorded:
            raise Missing(f"{self.run.path}: no /breaks (run with -record breaks)")
        return (run.breaks(s) for run in self.runs for s in range(len(run)))

    @cached_property
    def avalanche_counts(self):
        """Avalanches by size in every sample, the last left out: sparse [S, largest + 1]."""
        return size_counts([avalanche_sizes(breaks.load) for breaks in self._each_sample()])

    @cached_property
    def section(self):
        options = self.run.options
        height = options.get("-record_profile_height", options.get("-lattice_row_spacing", 1.0))
        return bond_sections(self.network, float(height))

    @cached_property
    def profiles(self):
        """n_b(y) up to the peak load and after it: two int[S, sections]."""
        section, sections = self.section, self.sections
        peak = [section_counts(b.bond[:n], section, sections) for b, n in zip(self._each_sample(), self.n_p)]
        after = [section_counts(b.bond[n:], section, sections) for b, n in zip(self._each_sample(), self.n_p)]
        return np.array(peak), np.array(after)

    def typical(self):
        """Position in `run` of the sample that is nearest to the medians of n_p and peak load."""
        run = self.run
        distance = sum(np.abs(values - np.median(values)) / (np.std(values) or 1.0)
                       for values in (run.n_p.astype(float), run.peak_load))
        return int(np.argmin(distance))


@dataclass(eq=False)
class Study:
    ensembles: dict                              # model to list of Ensemble by size
    remarks: list = field(default_factory=list)  # what the reader should know about the input

    @property
    def models(self):
        return [model for model in MODELS if self.ensembles.get(model)]

    def of(self, model):
        return self.ensembles.get(model, [])

    def all(self):
        return [ensemble for model in self.models for ensemble in self.of(model)]


def read_study(paths, resamples=RESAMPLES):
    """Reads run files, finished or still going on, and sorts them by model and size.

    paths may hold patterns (spring_*.h5). Raises ValueError, naming the file, for one that can't be read and for
    runs that don't belong together; a run without a finished sample is left out with a remark.
    """
    study = Study({})
    runs = []
    for path in _expand(paths):
        run = read_run(path)
        if os.path.isdir(path + ".shards"):
            study.remarks.append(f"{path}: the run is still going on or was interrupted; "
                                 f"{len(run)} finished samples so far")
        if not len(run):
            study.remarks.append(f"{path}: left out, no finished sample yet")
        elif run.options.get("-lattice") == "file":
            study.remarks.append(f"{path}: left out, a network from a file has no size L")
        else:
            _check_scene(runs, run)
            runs.append(run)
    if not runs:
        raise ValueError("; ".join(study.remarks) or "no run file given")
    _group(study, runs, resamples)
    _remark_on_input(study)
    return study


def _expand(paths):
    """Files of patterns; a name without a match stays, so that reading it says what is wrong. Each once."""
    found = [match for path in map(os.fspath, paths)
             for match in (sorted(glob.glob(path)) if not os.path.exists(path) else []) or [path]]
    return list(dict.fromkeys(found))


def _check_scene(runs, run):
    for other in runs[:1]:
        for name in sorted({*run.deciding, *other.deciding}):
            value, expected = run.options.get(name), other.options.get(name)
            if name not in FREE_OPTIONS and not name.startswith(FREE_STARTS) and value != expected:
                raise ValueError(f"{run.path}: {name} {value}, but {other.path} has {expected}: "
                                 "one report is of one scene; models, sizes and seeds may differ")


def _group(study, runs, resamples):
    for run in runs:
        model, size = run.options.get("-model", "spring"), int(run.options["-lattice_size"])
        siblings = study.ensembles.setdefault(model, [])
        same = next((ensemble for ensemble in siblings if ensemble.size == size), None)
        if same is None:
            siblings.append(Ensemble(model, size, [run], resamples))
            continue
        for other in same.runs:
            if other.options.get("-seed") == run.options.get("-seed") and np.isin(run.index, other.index).any():
                raise ValueError(f"{run.path}: holds samples that {other.path} holds too (same -seed, same numbers)")
        same.runs.append(run)
    for siblings in study.ensembles.values():
        siblings.sort(key=lambda ensemble: ensemble.size)


def _remark_on_input(study):
    for model in MODELS:
        if model not in study.models:
            study.remarks.append(f"no {model} run: the {model} side of every figure and table is missing")
    seeds = {}
    for ensemble in study.all():
        for run in ensemble.runs:
            seeds.setdefault(run.options.get("-seed"), set()).add((ensemble.model, ensemble.size))
        if not ensemble.failed:
            stop = ensemble.run.options["-stop"]
            study.remarks.append(f"{ensemble.run.path}: stopped by -stop {stop}: nothing can be said "
                                 "about failure, and the peak load is the largest until then")
        if not ensemble.recorded:
            study.remarks.append(f"{ensemble.run.path}: no /breaks (-record breaks): no avalanches, "
                                 "profiles, pictures")
        if len(ensemble) < 20:
            study.remarks.append(f"{ensemble.model}, L = {ensemble.size}: {len(ensemble)} samples; "
                                 "intervals of fewer than 20 are too narrow")
    if any(len(shared) > 1 for shared in seeds.values()):
        study.remarks.append("runs share a -seed, so that their samples share thresholds bond by bond; intervals take "
                             "sizes and models for independent: give each run its own -seed")
