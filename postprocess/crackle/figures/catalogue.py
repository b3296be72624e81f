"""Every figure of a study, by name: the table from which figures.py and the report's page are made."""
import os
from dataclasses import dataclass

from crackle.figures import avalanches, damage, profiles, strength, typical
from crackle.figures.style import in_style
from crackle.study.ensembles import Missing


@dataclass
class FigureKind:
    section: str
    draw: callable  # (study) to a matplotlib figure; raises Missing
    paper: str      # where the paper has it; empty: it goes beyond


FIGURES = {
    "response": FigureKind("One sample", typical.response, "Fig. 1"),
    "snapshots_spring": FigureKind("One sample", typical.snapshots_spring, "Fig. 2"),
    "snapshots_fuse": FigureKind("One sample", typical.snapshots_fuse, ""),
    "segments_before": FigureKind("One sample", typical.segments_before, "Fig. 3"),
    "segments_after": FigureKind("One sample", typical.segments_after, "Fig. 4"),
    "profile_peak": FigureKind("Localisation", profiles.profile_peak, "Fig. 5"),
    "profile_fourier": FigureKind("Localisation", profiles.profile_fourier, "sec. III"),
    "profile_collapse": FigureKind("Localisation", profiles.profile_collapse, "Fig. 6"),
    "damage_scaling": FigureKind("Damage", damage.damage_scaling, "Fig. 7"),
    "damage_peak_cdf": FigureKind("Damage", damage.damage_peak_cdf, "Fig. 8"),
    "damage_peak_collapse": FigureKind("Damage", damage.damage_peak_collapse, "Figs. 9 and 10"),
    "damage_failure_collapse": FigureKind("Damage", damage.damage_failure_collapse, "sec. V"),
    "strength_density": FigureKind("Strength", strength.strength_density, "Fig. 11(a)"),
    "strength_cdf": FigureKind("Strength", strength.strength_cdf, "Fig. 11(b)"),
    "strength_fits": FigureKind("Strength", strength.strength_fits, "Fig. 12"),
    "size_effect": FigureKind("Strength", strength.size_effect, "Fig. 13"),
    "avalanches": FigureKind("Avalanches", avalanches.avalanches, "Fig. 14"),
    "avalanche_collapse": FigureKind("Avalanches", avalanches.avalanche_collapse, "Fig. 15"),
    "avalanche_exponent": FigureKind("Avalanches", avalanches.avalanche_exponent, ""),
    "last_avalanche_scaling": FigureKind("Avalanches", damage.last_avalanche_scaling, "Fig. 16"),
    "last_avalanche_distribution": FigureKind("Avalanches", damage.last_avalanche_distribution, "Fig. 17"),
}


def make_figure(study, name, folder):
    """FOLDER/NAME.pdf and .png. Returns what is missing in it, a line each; raises Missing if nothing can be drawn."""
    with in_style():
        figure = FIGURES[name].draw(study)
        os.makedirs(folder, exist_ok=True)
        for ending in ("pdf", "png"):
            metadata = {"CreationDate": None} if ending == "pdf" else None  # same runs, same bytes
            figure.savefig(os.path.join(folder, f"{name}.{ending}"), dpi=180, metadata=metadata)
    return figure.notes


def make_all(study, names, folder):
    """Makes the figures named, telling each; returns how many could be made."""
    made = 0
    for remark in study.remarks:
        print(f"note: {remark}")
    for name in names:
        try:
            notes = make_figure(study, name, folder)
            made += 1
            print(os.path.join(folder, f"{name}.pdf"), *(f"({note})" for note in notes))
        except Missing as reason:
            print(f"{name}: not made: {reason}")
    return made
