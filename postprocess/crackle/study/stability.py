"""Runs solvers through the extreme scenes, and tells which get every bond right and which say that they don't.

A scene that names its strategies (-compare) is run with those.
"""
import csv
import subprocess
import sys
from pathlib import Path

import numpy as np

from crackle.files.comparison_file import read_comparison

STRATEGIES = ("tree", "updown", "woodbury", "cholmod", "mumps", "dense", "quad", "lagged", "circulant", "jacobi")
COLUMNS = ("scene", "strategy", "breaks", "first_difference", "first_doubtful", "refactors", "backward_error",
           "residual", "force_error", "outcome", "said")


def run_scene(program, scene, solvers, folder):
    """The comparison of one scene, or None; what went wrong goes to stderr."""
    output = folder / f"{scene.stem}.h5"
    command = [program, "-options_file", str(scene), "-compare_repetitions", "1", "-monitor", "none", "-overwrite",
               "-output", str(output)]
    if "-compare " not in scene.read_text():
        command += ["-compare", solvers]
    done = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, check=False)
    if done.returncode != 0:
        print(f"{scene}: {done.stderr.strip()}", file=sys.stderr)
        return None
    return read_comparison(output)


def largest(values):
    return float(np.nanmax(values)) if np.isfinite(values).any() else float("nan")


def judge(comparison, strategy):
    """One line of the CSV. Outcome: right; ends (with a message, nothing wrong before); told; silent."""
    get = strategy.attributes.get
    wrong, doubtful = strategy.first_difference, int(get("first_doubtful"))
    if wrong and doubtful and doubtful <= wrong:
        outcome = "told"
    elif wrong:
        outcome = "silent"
    else:
        outcome = "ends" if get("complaint") else "right"
    said = get("complaint")
    if doubtful:
        said = f"doubtful breaks: {int(get('doubtful'))}" + (f"; {said}" if said else "")
    return dict(zip(COLUMNS, (
        Path(comparison.path).stem, strategy.name, int(get("n_f")), wrong, doubtful,
        int(get("refactors")), largest(strategy.series["backward_error"]), largest(strategy.series["residual"]),
        largest(strategy.series["force_error"]), outcome, said)))


def cell(row):
    """Of the README's table."""
    if row["outcome"] == "right":
        renewed = f", {row['refactors']} new" if row["refactors"] else ""
        return f"{row['force_error']:.0e}{renewed}"
    if row["outcome"] == "ends":
        return f"ends at {row['breaks']}"
    if row["outcome"] == "told":
        return f"{row['first_difference']}, told at {row['first_doubtful']}"
    return f"**{row['first_difference']}, silent**"


def write_markdown(path, rows):
    scenes = list(dict.fromkeys(row["scene"] for row in rows))
    strategies = list(dict.fromkeys(row["strategy"] for row in rows))
    cells = {(row["scene"], row["strategy"]): cell(row) for row in rows}
    lines = ["| scene | " + " | ".join(f"`{s}`" for s in strategies) + " |", "| --- " * (len(strategies) + 1) + "|"]
    for scene in scenes:
        lines.append(f"| `{scene}` | " + " | ".join(cells.get((scene, s), "") for s in strategies) + " |")
    path.write_text("\n".join(lines) + "\n")


def run_scenes(program, scenes, solvers, folder):
    """Rows of all scenes that could be run. Leaves FOLDER/SCENE.h5, stability.csv and stability.md."""
    folder.mkdir(parents=True, exist_ok=True)
    rows = []
    for scene in scenes:
        comparison = run_scene(program, scene, solvers, folder)
        if comparison:
            found = [judge(comparison, strategy) for strategy in comparison.strategies]
            print(f"{scene.stem}: " + ", ".join(f"{row['strategy']} {row['outcome']}" for row in found), flush=True)
            rows += found
    with open(folder / "stability.csv", "w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, COLUMNS)
        writer.writeheader()
        writer.writerows(rows)
    write_markdown(folder / "stability.md", rows)
    return rows
