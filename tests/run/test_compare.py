"""crackle_compare from command line to file, and what postprocess draws of it."""
import shlex
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from crackle.figures.comparisons import style_of
from crackle.files import read_comparison
from networks import irregular_network
from program import PROGRAMS, break_samples, contents, datasets, environment, execute, succeed
from program import run as run_crackle

PROJECT = Path(__file__).resolve().parents[2]
COMPARE = PROGRAMS["crackle_compare"]
EVERY_SOLVER = sorted((PROJECT / "options").glob("solver/*.opts"))


def solvers(*names):
    return ",".join(str(PROJECT / "options" / f"solver/{name}.opts") for name in names)


def run(folder, line):
    return subprocess.run([COMPARE, *shlex.split(line)], cwd=folder, env=environment(), text=True,
                          stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.PIPE, timeout=100,
                          check=False)


def compare(folder, line, output="compare.h5"):
    result = run(folder, f"{line} -monitor none -output {output}")
    assert result.returncode == 0, result.stderr
    return read_comparison(folder / output), result.stdout


def by_name(comparison):
    return {strategy.name: strategy for strategy in comparison.strategies}


@pytest.mark.parametrize("model", ["spring", "fuse"])
def test_every_solver_breaks_the_same_bonds(tmp_path, model):
    files = ",".join(map(str, EVERY_SOLVER))
    line = f"-model {model} -lattice_size 8 -compare {files} -compare_every 5 -compare_repetitions 1"
    comparison, table = compare(tmp_path, line)
    assert len(comparison.strategies) == len(EVERY_SOLVER) > 12
    for strategy in comparison.strategies:
        get = strategy.attributes.get
        assert strategy.first_difference == 0 and get("complaint") == "", strategy.name
        assert (get("n_p"), get("n_f")) == (comparison.reference["n_p"], comparison.reference["n_f"])
        assert get("peak_error") < 1e-9
        assert np.max(strategy.series["force_error"]) < 1e-8, strategy.name
        assert np.isfinite(strategy.ms_per_break) and get("memory") > 0
        assert strategy.name in table
    assert comparison.reference_error.max() < 1e-14


def test_tolerances_loose_differ_and_are_told_tight_do_not(tmp_path):
    line = (f"-lattice_size 16 -compare {solvers('circulant', 'jacobi', 'tree')} -compare_rtol 1e-2,1e-12 "
            "-compare_repetitions 2")
    comparison, table = compare(tmp_path, line)
    found = by_name(comparison)
    assert set(found) == {"circulant 1e-2", "circulant 1e-12", "jacobi 1e-2", "jacobi 1e-12", "tree"}
    loose, tight = found["circulant 1e-2"], found["circulant 1e-12"]
    assert loose.first_difference > 0 and loose.attributes["first_doubtful"] <= loose.first_difference
    assert "circulant 1e-2: residuals up to" in table
    assert tight.first_difference == 0 == found["tree"].first_difference
    assert loose.series["time"].shape == (2, len(comparison.number))
    assert np.all(np.diff(tight.series["time"][0]) >= 0) and tight.series["time"][0][-1] > 0
    # residuals are 1e10 apart, and a force's error is about its residual
    assert np.median(loose.series["force_error"]) > 1e6 * np.median(tight.series["force_error"])
    # the same iterations on the same networks, ended earlier
    assert loose.attributes["iterations"] < tight.attributes["iterations"]


def test_along_its_own_breaks_a_loose_solver_ends_elsewhere(tmp_path):
    line = f"-lattice_size 16 -compare {solvers('circulant')} -compare_rtol 1e-1 -compare_along own"
    comparison, _ = compare(tmp_path, f"{line} -compare_repetitions 1")
    strategy, = comparison.strategies
    assert strategy.first_difference > 0
    measured = comparison.number < strategy.first_difference
    assert np.isfinite(strategy.series["force_error"][measured]).all()
    assert np.isnan(strategy.series["force_error"][comparison.number > strategy.first_difference]).all()
    assert strategy.attributes["peak_error"] > 0


def test_skipped_breaks_are_those_of_the_whole_comparison(tmp_path):
    line = f"-lattice_size 10 -compare {solvers('tree', 'updown', 'mumps', 'woodbury')} -compare_repetitions 1"
    whole, _ = compare(tmp_path, line, "whole.h5")
    part, _ = compare(tmp_path, f"{line} -compare_skip 20 -stop breaks=40 -compare_every 4", "part.h5")
    assert part.number.tolist() == [21, 25, 29, 33, 37]
    np.testing.assert_allclose(part.stiffness, whole.stiffness[20:40], rtol=1e-12)
    assert all(s.first_difference == 0 and s.attributes["n_f"] == 40 for s in part.strategies)


def test_mistakes_are_told_before_time_is_spent(tmp_path):
    (tmp_path / "bad.opts").write_text("-ksp_type cg\n-pc_tipe jacobi\n")
    (tmp_path / "there.h5").write_text("mine")
    tree = solvers("tree")
    for line, words in [
            ("-lattice_size 4", ["-compare", "not given"]),
            ("-lattice_size 4 -compare none.opts", ["-compare", "none.opts"]),
            ("-lattice_size 4 -compare bad.opts", ["bad", "-pc_tipe"]),
            (f"-compare {tree} -compare_rtol 2", ["-compare_rtol", "2", "between 0 and 1"]),
            (f"-compare {tree} -compare_every 0", ["-compare_every", "0"]),
            (f"-compare {tree} -stop stiffness=0.5", ["-stop", "stiffness=0.5", "failure or breaks=n"]),
            (f"-compare {tree} -samples 2", ["-samples", "2"]),
            (f"-compare {tree} -lattice_size 4 -compare_skip 500", ["-compare_skip", "500"]),
            (f"-compare {tree} -output there.h5", ["there.h5", "-overwrite"]),
            (f"-compare {tree} -output no/where.h5", ["no/where.h5"])]:
        before = contents(tmp_path)
        result = run(tmp_path, line)
        assert result.returncode == 1 and result.stderr.count("\n") == 1, (line, result.stderr)
        assert all(word in result.stderr for word in words), (line, result.stderr)
        assert contents(tmp_path) == before


def test_several_processes_are_refused(tmp_path):
    """Each would be a comparison of its own, and wait for ever for those that the output's lock sent away."""
    result = execute(tmp_path, f"crackle_compare -lattice_size 4 -compare {solvers('tree')} -monitor none", ranks=2)
    said = [line for line in result.stderr.splitlines() if line.startswith("crackle_compare: ")]
    assert result.returncode == 1 and len(said) == 1 and "processes 2" in said[0], result
    assert not contents(tmp_path)


def test_every_extreme_scene_is_right_or_told_by_tree_and_updown(tmp_path):
    for scene in sorted((PROJECT / "options").glob("extreme/*.opts")):
        if scene.stem == "downdates":
            continue  # minutes long: postprocess/stability.py
        line = f"-options_file {scene} -compare {solvers('tree', 'updown')} -compare_repetitions 1 -compare_every 25"
        small = "" if scene.stem == "dilution" else "-lattice_size 8"
        comparison, _ = compare(tmp_path, f"{line} {small} -overwrite")
        for strategy in comparison.strategies:
            assert strategy.first_difference == 0, (scene.stem, strategy.name)
            if strategy.attributes["complaint"] == "":
                assert strategy.attributes["n_f"] == comparison.reference["n_f"], (scene.stem, strategy.name)


@pytest.mark.parametrize("solver", ["-equilibrium tree", "-equilibrium dense", "-pc_type updown", "-pc_type woodbury",
                                    "-ksp_type cg -pc_type icc"])
def test_check_measures_the_residual_at_every_third_break(tmp_path, solver):
    line = f"-lattice_size 6 -monitor none -overwrite {solver}"
    plain = break_samples(tmp_path, line, "plain.h5")
    result = succeed(tmp_path, f"{line} -equilibrium_check 3 -output checked.h5")
    breaks = len(plain["/breaks/bond"])
    assert datasets(tmp_path / "checked.h5")["/breaks/bond"].tolist() == plain["/breaks/bond"].tolist()
    assert f"residual checked     at {-(-breaks // 3)} breaks" in result.stdout
    assert float(result.stdout.split("largest residual")[1].split()[0]) < 1e-12
    impossible = run_crackle(tmp_path, f"{line} -equilibrium_check 3 -equilibrium_check_bound 1e-25")
    assert impossible.returncode == 1 and "-equilibrium_check" in impossible.stderr


def test_loose_iteration_says_so_in_the_summary(tmp_path):
    line = "-lattice_size 8 -monitor none -overwrite -ksp_type cg -pc_type circulant"
    assert "doubtful breaks" in succeed(tmp_path, f"{line} -ksp_rtol 1e-2").stdout
    assert "doubtful breaks" not in succeed(tmp_path, line).stdout


def postprocess(script, *arguments):
    return subprocess.run([sys.executable, PROJECT / "postprocess" / script, *map(str, arguments)], cwd=PROJECT,
                          stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, check=False)


def test_four_figures_from_two_sizes(tmp_path):
    line = f"-compare {solvers('tree', 'jacobi')} -compare_rtol 1e-2,1e-8 -compare_repetitions 1"
    for size in (5, 8):
        compare(tmp_path, f"{line} -lattice_size {size}", f"c{size}.h5")
    result = postprocess("compare.py", tmp_path / "c5.h5", tmp_path / "c8.h5", "-o", tmp_path / "figures")
    assert result.returncode == 0, result.stderr
    assert {path.name for path in (tmp_path / "figures").iterdir()} == {
        "work_precision.png", "time.png", "error_c5.png", "error_c8.png", "iterations_c5.png", "iterations_c8.png"}
    assert all(path.stat().st_size > 5000 for path in (tmp_path / "figures").iterdir())


def test_network_from_a_file_is_drawn_too(tmp_path):
    irregular_network(1, components=1).write(tmp_path / "network.h5")
    line = f"-lattice file -lattice_file network.h5 -compare_repetitions 1 -compare {solvers('tree', 'quad')}"
    compare(tmp_path, line)
    result = postprocess("compare.py", tmp_path / "compare.h5", "-o", tmp_path)
    assert result.returncode == 0 and "several sizes" in result.stderr, result.stderr
    assert {path.name for path in tmp_path.glob("*.png")} == {
        "work_precision.png", "error_compare.png", "iterations_compare.png"}
    result = postprocess("compare.py", tmp_path / "compare.h5", "-f", "time", "-o", tmp_path)
    assert result.returncode == 1 and result.stderr.count("\n") == 1


def test_every_solver_has_a_look_of_its_own():
    families = [path.stem for path in (PROJECT / "options").glob("solver/*.opts")]
    assert len({tuple(style_of(name).values()) for name in ["any other", *families]}) == len(families) + 1 > 15


def test_other_files_are_refused_in_a_line(tmp_path):
    (tmp_path / "text.h5").write_text("no HDF5")
    for path in ("missing.h5", "text.h5"):
        result = postprocess("compare.py", tmp_path / path)
        assert result.returncode == 1 and result.stderr.count("\n") == 1 and path in result.stderr


def test_stability_table_has_a_cell_for_each_strategy(tmp_path):
    scene = tmp_path / "small.opts"
    scene.write_text("-lattice_size 5\n-stiffness inclusion\n-stiffness_contrast 1e12\n")
    result = postprocess("stability.py", scene, "-c", COMPARE, "-s", solvers("tree", "updown", "jacobi"),
                         "-o", tmp_path / "out")
    assert result.returncode == 0, result.stderr
    table = (tmp_path / "out" / "stability.md").read_text().splitlines()
    assert table[0] == "| scene | `tree` | `updown` | `jacobi` |" and table[2].startswith("| `small` |")
    lines = (tmp_path / "out" / "stability.csv").read_text().splitlines()
    assert len(lines) == 4 and "silent" not in table[2].split("|")[2] + table[2].split("|")[3]
