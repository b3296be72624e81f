"""Tables of a study: the paper's beside ours, the exponents, goodness of fit and likelihood ratios.

Every table is a Table of texts, for the page, and of plain values, for CSV; a row that can't be made says why.
"""
import csv
from dataclasses import dataclass, field

import numpy as np

from crackle.statistics.strength_fits import FAMILIES
from crackle.study import paper
from crackle.study.analysis import (LEAST_SAMPLES, LEAST_SIZE, avalanche_scaling, lognormal_parameters, normal_goodness,
                                    profile_scaling, size_law, strength_comparison, strength_goodness, tau_at_size)
from crackle.study.ensembles import MODELS, Missing


@dataclass
class Table:
    name: str
    title: str
    columns: list
    rows: list = field(default_factory=list)
    note: str = ""

    def write(self, path):
        with open(path, "w", newline="", encoding="utf-8") as file:
            writer = csv.writer(file)
            writer.writerow(self.columns)
            writer.writerows(self.rows)


def rounded(value, error=None, digits=4):
    """As many digits as the error has: two of it; without an error, `digits` significant ones."""
    if value is None or not np.isfinite(value):
        return ""
    if error is None or not error > 0:
        return f"{value:.{digits}g}"
    places = int(np.clip(1 - np.floor(np.log10(error)), 0, 8))
    return f"{value:.{places}f}"


def with_error(value, error):
    """1.8161(17): the digits in brackets are the standard error of the last ones."""
    if not error > 0:
        return rounded(value)
    places = int(np.clip(1 - np.floor(np.log10(error)), 0, 8))
    return f"{value:.{places}f}({round(error * 10 ** places)})"


PEAK, FAILURE, LOAD = ("p_p", "p_p_std"), ("p_f", "p_f_std"), ("peak_load", "peak_load_std")


def _paper_table(study, name, title, quantities, note):
    """Mean and standard deviation of each quantity beside the paper's. quantities: (label, columns, values, failed);
    columns None: the paper has no such quantity."""
    table = Table(name, title, ["model", "L", "samples", "quantity", "mean", "paper", "deviation (s.e.)", "std",
                                "paper std", "std deviation (s.e.)"], note=note)
    reference = paper.spring_tables()
    for ensemble in study.all():
        row = np.flatnonzero((reference["L"] == ensemble.size) & (ensemble.model == "spring"))
        for label, columns, values, failed in quantities:
            if len(ensemble) < 2 or failed and not ensemble.failed:
                continue
            sample = values(ensemble)
            n, std = len(sample), sample.std(ddof=1)
            cells = [ensemble.model, ensemble.size, n, label, with_error(sample.mean(), std / np.sqrt(n))]
            if len(row) and columns:
                mean_p, std_p, n_p = (reference[c][row[0]] for c in (*columns, "n_samples"))
                rounding = 1e-4 ** 2 / 12
                deviation = (sample.mean() - mean_p) / np.sqrt(std ** 2 / n + std_p ** 2 / n_p + rounding)
                spread = (std - std_p) / np.sqrt(std ** 2 / (2 * n) + std_p ** 2 / (2 * n_p) + rounding)
                cells += [f"{mean_p:.4f}", f"{deviation:+.1f}", f"{std:.4f}", f"{std_p:.4f}", f"{spread:+.1f}"]
            else:
                cells += ["", "", f"{std:.4f}", "", ""]
            table.rows.append(cells)
    return table


def table_damage(study):
    return _paper_table(study, "damage", "Table 1: fraction of broken bonds at peak load and at failure",
                        [("p_p", PEAK, lambda e: e.n_p / e.bonds, False),
                         ("p_f", None, lambda e: e.n_f / e.bonds, True),
                         ("p_f, n_f + 1", FAILURE, lambda e: (e.n_f + 1) / e.bonds, True)],
                        "Our n_f counts the bonds that broke. The paper's is one higher: it counts the step at which the "
                        "load is found to be zero, too.")


def table_peak_load(study):
    return _paper_table(study, "peak_load", "Table 2: peak load",
                        [("peak load", LOAD, lambda e: e.peak_load, False)],
                        "Deviations in standard errors of the difference, both sides' sampling errors and the paper's "
                        "rounding included.")


def _size_law(key):
    return lambda study, model: size_law(study, model, key).exponent


def _avalanche(kind, name):
    def value(study, model):
        scaling = avalanche_scaling(study, model)
        found = getattr(scaling, kind)
        if not found:
            raise Missing(f"2 sizes of {LEAST_SIZE} and more with 1000 avalanches are needed")
        return found[name] if isinstance(found, dict) else found
    return value


EXPONENTS = [  # the paper's key, what it is, the law, the value
    ("n_p", "broken bonds at peak load", "n_p ~ N_el^b", _size_law("n_p")),
    ("last_avalanche", "last avalanche", "n_f - n_p ~ N_el^b", _size_law("last_avalanche")),
    ("peak_load", "peak load", "F_peak = C0 L^alpha + C1", _size_law("peak_load")),
    ("strength", "mean strength", "mu_f = mu* (ln L)^-psi + c/L", _size_law("strength")),
    ("localization", "localisation length (collapse)", "xi ~ L^alpha",
     lambda study, model: profile_scaling(study, model).localization),
    ("profile_peak", "height of the damage profile", "<Delta p(0)> ~ L^-x",
     lambda study, model: profile_scaling(study, model).peak),
    ("tau", "avalanches, maximum likelihood, largest L", "P(s) ~ s^-tau exp(-s/s0)", _avalanche("tau", "tau")),
    ("tau", "avalanches, maximum likelihood, all L", "the same with s0 ~ N_el^(D/2): tau", _avalanche("joint", "tau")),
    ("dimension", "avalanches, maximum likelihood, all L", "the same with s0 ~ N_el^(D/2): D",
     _avalanche("joint", "dimension")),
    ("tau", "avalanches, best collapse", "s^-tau g(s/N_el^(D/2)): tau", _avalanche("collapse", "tau")),
    ("dimension", "avalanches, best collapse", "s^-tau g(s/N_el^(D/2)): D", _avalanche("collapse", "dimension")),
]


def agrees(ours, text):
    """Does our interval meet the range that the paper's rounded number stands for?"""
    half = paper.rounding(text)
    return ours.low <= float(text) + half and ours.high >= float(text) - half


def table_exponents(study):
    """The one table: paper's value, ours, interval, agree or not."""
    table = Table("exponents", "Exponents: the paper's and ours",
                  ["model", "quantity", "law", "paper", "ours", "low", "high", "agree", "paper's tables, our fit", "fit",
                   "fit's p"],
                  note="Intervals: 95 %, bootstrap over samples; they hold statistical errors only. Agree: our interval "
                  "meets the range that the paper's rounded value stands for; the paper gives no errors, and its sizes "
                  "reach 256. Paper's tables, our fit: the same fit on Tables 1 and 2. Fit: chi-squared per degree of "
                  "freedom, the collapse's quality S, or sqrt(n) D of a maximum-likelihood fit: far above 1, the law "
                  "does not describe the data within their errors, and the exponent is an effective one for these "
                  f"sizes. Sizes from L = {LEAST_SIZE} and {LEAST_SAMPLES} samples on, where they are enough.")
    for model in MODELS:
        if not study.of(model):
            continue
        for key, quantity, law, value in EXPONENTS:
            text = paper.exponents().get((key, model), "")
            try:
                table.rows.append([model, quantity, law, text, *_exponent_cells(value(study, model), text, model, key)])
            except Missing as reason:
                table.rows.append([model, quantity, law, text, f"not made: {reason}", "", "", "", "", "", ""])
    return table


def _exponent_cells(ours, text, model, key):
    """Cells from `ours` on: value, interval, verdict, the same fit on the paper's tables, how good our fit is."""
    verdict = ("yes" if agrees(ours, text) else "no") if text else "no value"
    refitted = paper.refitted(key, LEAST_SIZE) if model == "spring" else None
    return [*(rounded(x, ours.error) for x in (ours.value, ours.low, ours.high)), verdict,
            with_error(refitted.value, refitted.error) if refitted else "",
            "" if ours.misfit is None else f"{ours.misfit:.1f}",
            "" if ours.p_value is None else f"{ours.p_value:.2g}"]


def table_strength(study):
    """Families of strength distributions, each fitted to each ensemble."""
    table = Table("strength", "Strength: goodness of fit",
                  ["model", "L", "samples", "family", "parameters", "sqrt(n) D", "KS p", "A^2", "AD p"],
                  note="Kolmogorov-Smirnov and Anderson-Darling; p by parametric bootstrap of 199 draws (least: 0.005).")
    for ensemble in study.all():
        for family in FAMILIES:
            try:
                fitted, test = strength_goodness(ensemble, family)
            except Missing as reason:
                table.rows.append([ensemble.model, ensemble.size, len(ensemble), family, f"not made: {reason}",
                                   "", "", "", ""])
                continue
            parameters = _parameters(ensemble, fitted)
            table.rows.append([ensemble.model, ensemble.size, len(ensemble), family, parameters, f"{test.ks:.2f}",
                               f"{test.ks_p:.3f}", f"{test.ad:.2f}", f"{test.ad_p:.3f}"])
    return table


def _parameters(ensemble, fitted):
    """name = value, ...; the lognormal ones with their intervals."""
    if fitted.family == "lognormal":
        return ", ".join(f"{name} = {rounded(e.value, e.error)} [{rounded(e.low, e.error)}, {rounded(e.high, e.error)}]"
                         for name, e in lognormal_parameters(ensemble).items())
    return ", ".join(f"{name} = {value:.4g}" for name, value in fitted.parameters.items())


def table_likelihood(study):
    """Vuong's test of the lognormal distribution against the others."""
    table = Table("likelihood", "Strength: lognormal against the others (likelihood ratio)",
                  ["model", "L", "samples", "lognormal against", "ln ratio per sample", "score", "p", "better"],
                  note="Vuong's test, Akaike's penalty for parameters; better: at p below 0.05.")
    for ensemble in study.all():
        for family in FAMILIES:
            if family == "lognormal":
                continue
            try:
                test = strength_comparison(ensemble, "lognormal", family)
            except Missing:
                continue
            better = "undecided" if test.p_value >= 0.05 else "lognormal" if test.ratio > 0 else family
            table.rows.append([ensemble.model, ensemble.size, len(ensemble), family, f"{test.ratio:+.5f}",
                               f"{test.score:+.1f}", f"{test.p_value:.2g}", better])
    return table


def table_normality(study):
    """Normal distributions for the numbers of broken bonds."""
    table = Table("normality", "Broken bonds: goodness of a normal distribution",
                  ["model", "L", "samples", "quantity", "sqrt(n) D", "KS p", "A^2", "AD p"],
                  note="Counts are spread over their steps before they are tested.")
    for ensemble in study.all():
        for quantity in ("n_p", "n_f", "last_avalanche"):
            try:
                test = normal_goodness(ensemble, quantity)
            except Missing:
                continue
            name = quantity.replace("last_avalanche", "n_f - n_p")
            table.rows.append([ensemble.model, ensemble.size, len(ensemble), name, f"{test.ks:.2f}",
                               f"{test.ks_p:.3f}", f"{test.ad:.2f}", f"{test.ad_p:.3f}"])
    return table


def table_avalanches(study):
    """tau and cutoff of every size alone."""
    table = Table("avalanches", "Avalanches of every size alone: s^-tau exp(-s/s0), maximum likelihood",
                  ["model", "L", "avalanches", "s_min", "tau", "s0", "sqrt(n) D"],
                  note="s_min: the smallest from which on the law is not rejected (sqrt(n) D below 0.9). Where it has to "
                  "be large, the scaling range is too short for an exponent: see the figure avalanche_exponent.")
    for ensemble in study.all():
        try:
            fit, _ = tau_at_size(ensemble)
        except Missing:
            continue
        table.rows.append([ensemble.model, ensemble.size, int(ensemble.avalanche_counts.sum()), fit.s_min,
                           f"{fit.tau:.3f}", f"{fit.amplitude:.4g}", f"{fit.score:.2f}"])
    return table


TABLES = (table_exponents, table_damage, table_peak_load, table_strength, table_likelihood, table_normality,
          table_avalanches)
