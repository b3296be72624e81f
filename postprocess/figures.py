#!/usr/bin/env python3
"""Makes figures of the paper from run files, each as PDF and PNG.

    figures.py NAME ... -i 'spring_*.h5' 'fuse_*.h5' [-o FOLDER]     figures.py --list

NAME `all` makes every one. A figure that can't be made from the runs given is told with the reason; the others are
made all the same.
"""
import argparse
import os
from dataclasses import dataclass

import draw_avalanches
import draw_damage
import draw_profiles
import draw_samples
import draw_strength
from plot_style import plt
from study import Missing, read_study


@dataclass
class FigureKind:
    section: str
    draw: callable  # (study) to a matplotlib figure; raises Missing
    paper: str      # where the paper has it; empty: it goes beyond


FIGURES = {
    "response": FigureKind("One sample", draw_samples.response, "Fig. 1"),
    "snapshots_spring": FigureKind("One sample", draw_samples.snapshots_spring, "Fig. 2"),
    "snapshots_fuse": FigureKind("One sample", draw_samples.snapshots_fuse, ""),
    "segments_before": FigureKind("One sample", draw_samples.segments_before, "Fig. 3"),
    "segments_after": FigureKind("One sample", draw_samples.segments_after, "Fig. 4"),
    "profile_peak": FigureKind("Localisation", draw_profiles.profile_peak, "Fig. 5"),
    "profile_fourier": FigureKind("Localisation", draw_profiles.profile_fourier, "sec. III"),
    "profile_collapse": FigureKind("Localisation", draw_profiles.profile_collapse, "Fig. 6"),
    "damage_scaling": FigureKind("Damage", draw_damage.damage_scaling, "Fig. 7"),
    "damage_peak_cdf": FigureKind("Damage", draw_damage.damage_peak_cdf, "Fig. 8"),
    "damage_peak_collapse": FigureKind("Damage", draw_damage.damage_peak_collapse, "Figs. 9 and 10"),
    "damage_failure_collapse": FigureKind("Damage", draw_damage.damage_failure_collapse, "sec. V"),
    "strength_density": FigureKind("Strength", draw_strength.strength_density, "Fig. 11(a)"),
    "strength_cdf": FigureKind("Strength", draw_strength.strength_cdf, "Fig. 11(b)"),
    "strength_fits": FigureKind("Strength", draw_strength.strength_fits, "Fig. 12"),
    "size_effect": FigureKind("Strength", draw_strength.size_effect, "Fig. 13"),
    "avalanches": FigureKind("Avalanches", draw_avalanches.avalanches, "Fig. 14"),
    "avalanche_collapse": FigureKind("Avalanches", draw_avalanches.avalanche_collapse, "Fig. 15"),
    "avalanche_exponent": FigureKind("Avalanches", draw_avalanches.avalanche_exponent, ""),
    "last_avalanche_scaling": FigureKind("Avalanches", draw_damage.last_avalanche_scaling, "Fig. 16"),
    "last_avalanche_distribution": FigureKind("Avalanches", draw_damage.last_avalanche_distribution, "Fig. 17"),
}


def make_figure(study, name, folder):
    """FOLDER/NAME.pdf and .png. Returns what is missing in it, a line each; raises Missing if nothing can be drawn."""
    figure = FIGURES[name].draw(study)
    try:
        os.makedirs(folder, exist_ok=True)
        for ending in ("pdf", "png"):
            metadata = {"CreationDate": None} if ending == "pdf" else None  # same runs, same bytes
            figure.savefig(os.path.join(folder, f"{name}.{ending}"), dpi=180, metadata=metadata)
        return figure.notes
    finally:
        plt.close(figure)


def main():
    parser = argparse.ArgumentParser(description="Figures of the paper from run files, as PDF and PNG.")
    parser.add_argument("names", metavar="NAME", nargs="*", help="of --list, or: all")
    parser.add_argument("-i", "--input", nargs="+", metavar="RUN.h5", help="run files or patterns")
    parser.add_argument("-o", "--output", default=".", metavar="FOLDER")
    parser.add_argument("--list", action="store_true", help="names of all figures")
    arguments = parser.parse_args()
    if arguments.list:
        for name, kind in FIGURES.items():
            print(f"{name:28}{kind.draw.__doc__.splitlines()[0]}")
        return
    names = list(FIGURES) if "all" in arguments.names else arguments.names
    unknown = [name for name in names if name not in FIGURES]
    try:
        if not names or unknown:
            raise ValueError(f"figure {' '.join(unknown) or 'missing'}: all, or any of {' '.join(FIGURES)}")
        if not arguments.input:
            raise ValueError("no run file given: -i RUN.h5 ...")
        made = make_all(read_study(arguments.input), names, arguments.output)
    except (ValueError, OSError) as error:
        raise SystemExit(f"figures.py: {error}") from error
    if not made:
        raise SystemExit("figures.py: no figure could be made")


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


if __name__ == "__main__":
    main()
