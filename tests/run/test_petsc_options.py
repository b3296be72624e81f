"""-help, -monitor and PETSc's own options do what a user of PETSc expects of them."""
import re

import pytest
from networks import small_network
from program import LONGEST, OUTPUT, assert_same, break_samples, contents, datasets, run, start, succeed

OPTIONS = {  # of crackle: the default that -help gives
    "-model": "spring", "-lattice": "triangular", "-lattice_size": "16", "-lattice_row_spacing": "1",
    "-lattice_file": "", "-grips": "sliding", "-break_on": "magnitude", "-disorder": "uniform", "-seed": "1",
    "-samples": "1", "-first_sample": "0", "-stop": "failure", "-output": "crackle.h5", "-resume": "false",
    "-record": "breaks",
}


@pytest.mark.parametrize("line", ["-help", "-lattice_size 4 -help", "-help -equilibrium dense"])
def test_help_lists_every_option_and_runs_nothing(tmp_path, line):
    result = succeed(tmp_path, line)
    assert contents(tmp_path) == {} and result.stderr == ""
    for name, default in OPTIONS.items():
        assert re.search(rf"^ *{name} +\({re.escape(default)}\) \S", result.stdout, re.M), name
    for name in ("-equilibrium", "-monitor", "-overwrite"):
        assert re.search(rf"^ *{name} +\(.+\) \S", result.stdout, re.M), name
    assert "samples, mean" not in result.stdout


def test_help_lists_the_options_of_the_solver(tmp_path):
    result = succeed(tmp_path, "-help -ksp_type cg")
    for name in ("-ksp_type", "-ksp_rtol", "-pc_type", "-pc_updown_rank", "-log_view", "-options_file"):
        assert name in result.stdout


def test_version_runs_nothing(tmp_path):
    result = succeed(tmp_path, "-help intro")
    assert "crackle" in result.stdout and contents(tmp_path) == {}


def test_ksp_view_shows_the_solver_in_use(tmp_path):
    default = succeed(tmp_path, "-lattice_size 3 -ksp_view").stdout
    assert "KSP Object" in default and "type: preonly" in default and "type: updown" in default
    other = succeed(tmp_path, "-lattice_size 3 -ksp_view -ksp_type cg -pc_type jacobi -overwrite").stdout
    assert "type: cg" in other and "type: jacobi" in other and "updown" not in other


def test_ksp_monitor_shows_a_residual_that_falls(tmp_path):
    line = "-lattice_size 3 -ksp_monitor -ksp_type cg -pc_type jacobi -stop breaks=0"
    output = succeed(tmp_path, line).stdout
    norms = [float(norm) for norm in re.findall(r"^ *\d+ KSP Residual norm (\S+)", output, re.M)]
    assert len(norms) > 3 and norms[-1] < 1e-11 * norms[0]


@pytest.mark.parametrize("solver", ["", "-ksp_type cg"])
def test_ksp_converged_reason_is_told_at_every_solve(tmp_path, solver):
    output = succeed(tmp_path, f"-lattice_size 3 -ksp_converged_reason {solver} -stop breaks=2").stdout
    assert output.count("Linear solve converged due to") == 3


def test_views_of_the_solver_change_no_result(tmp_path):
    plain = break_samples(tmp_path, "-lattice_size 5 -equilibrium ksp", "plain.h5")
    line = "-lattice_size 5 -equilibrium ksp -ksp_view -ksp_monitor -log_view -options_left -info :info.txt"
    assert_same(break_samples(tmp_path, line), plain)


def test_log_view_shows_where_the_time_goes(tmp_path):
    """One event a phase; as many downdates and searches as breaks."""
    output = succeed(tmp_path, "-lattice_size 6 -samples 2 -equilibrium ksp -log_view").stdout
    breaks = int(datasets(tmp_path / OUTPUT)["/samples/n_f"].sum())
    phases = "assembly|factor|downdate|solve|search|output"
    events = dict(re.findall(rf"^(?:\S*_)?({phases}) +(\d+) ", output, re.M))
    assert events.keys() == set(phases.split("|"))
    assert int(events["downdate"]) == breaks
    assert breaks <= int(events["search"]) <= breaks + 2
    assert breaks <= int(events["solve"]) <= breaks + 2


def test_log_view_into_a_file(tmp_path):
    succeed(tmp_path, "-lattice_size 3 -log_view :log.txt")
    assert "crackle_search" in (tmp_path / "log.txt").read_text()


def test_options_left_finds_none_left(tmp_path):
    output = succeed(tmp_path, "-lattice_size 3 -options_left").stdout
    assert "no unused options" in output and "-lattice_size 3" in output


@pytest.mark.parametrize("option", ["-malloc_debug", "-malloc_dump", "-malloc_view", "-memory_view",
                                    "-fp_trap", "-on_error_abort", "-no_signal_handler", "-options_view"])
def test_petsc_options_for_developers(tmp_path, option):
    result = succeed(tmp_path, f"-lattice_size 3 -monitor none {option}")
    assert result.stderr == ""


@pytest.mark.parametrize("scene", ["-lattice_size 8 -disorder constant", "-lattice_size 8 -model fuse",
                                   "-lattice_size 40", "-lattice_size 40 -equilibrium_tree_precision double"])
def test_no_exception_of_arithmetic(tmp_path, scene):
    """By responses alone, with ties, and where a factor goes on."""
    succeed(tmp_path, f"{scene} -monitor none -fp_trap")


def test_monitor_none_is_silent(tmp_path):
    assert succeed(tmp_path, "-lattice_size 4 -samples 3 -monitor none").stderr == ""


def test_monitor_tells_progress_without_a_terminal(tmp_path):
    lines = succeed(tmp_path, "-lattice_size 4 -samples 3").stderr.splitlines()
    assert 1 <= len(lines) <= 2 and lines[-1].startswith("3 of 3 samples")
    assert "\r" not in lines[-1] and "\033" not in lines[-1]


def test_report_gives_the_means_of_the_file(tmp_path):
    output = succeed(tmp_path, "-lattice_size 4 -samples 5").stdout
    found = datasets(tmp_path / OUTPUT)
    for name, label in (("peak_load", "peak load"), ("n_p", "n_p"), ("n_f", "n_f")):
        mean = float(re.search(rf"^ *{label} +(\S+) \+- ", output, re.M).group(1))
        assert mean == pytest.approx(found[f"/samples/{name}"].mean(), rel=1e-5)
    assert f"written: {OUTPUT}" in output


def test_options_of_the_environment_count(tmp_path, monkeypatch):
    """PETSC_OPTIONS is a command line too; mistakes in it are told."""
    monkeypatch.setattr("program.environment", lambda: {"PETSC_OPTIONS": "-lattice_size 3 -record network"})
    succeed(tmp_path, "-monitor none")
    assert datasets(tmp_path / OUTPUT)["/network/nodes/grip"].shape == (16,)
    monkeypatch.setattr("program.environment", lambda: {"PETSC_OPTIONS": "-latice_size 3"})
    assert "did you mean -lattice_size?" in run(tmp_path, "-overwrite").stderr


def test_starts_without_a_folder_for_temporary_files(tmp_path, monkeypatch):
    """MPI's folder of a session, in TMPDIR, would be the same for all processes that start at once: they fail
    now and then, when one makes it while another takes it away.
    """
    monkeypatch.setenv("TMPDIR", "/proc")
    succeed(tmp_path, "-lattice_size 2 -monitor none")


def test_output_that_nobody_reads_any_more(tmp_path):
    """`crackle ... | head -1` ends the run or lets it go on, without a screen of errors."""
    process = start(tmp_path, "-lattice_size 6 -ksp_view -monitor none")
    process.stdout.readline()
    process.stdout.close()
    errors = process.stderr.read()
    process.wait(timeout=LONGEST)
    assert errors.count("\n") <= 1, errors


@pytest.mark.parametrize("solver", ["-ksp_type preonly -pc_type jacobi", "-ksp_type preonly -pc_type ilu",
                                    "-ksp_type cg -pc_type none -ksp_max_it 2"])
def test_solver_that_does_not_solve_is_told(tmp_path, solver):
    """Never a false result: one line that says what to try."""
    result = run(tmp_path, f"-lattice_size 6 -monitor none {solver}")
    assert result.returncode == 1
    assert result.stderr.count("\n") == 1 and result.stderr.startswith("crackle: sample 0")
    assert "-pc_type" in result.stderr


def test_solver_with_null_pivots_is_told_or_right(tmp_path):
    """A dangling bond under a solver that does not pin null pivots."""
    small_network().with_parts([[3.0, 0.5]], [[2, 6]]).write(tmp_path / "network.h5")
    line = "-lattice file -lattice_file network.h5 -disorder file -monitor none"
    result = run(tmp_path, f"{line} -pc_type cholesky -pc_factor_mat_solver_type cholmod")
    right = break_samples(tmp_path, line, "right.h5")
    if result.returncode == 0:
        assert datasets(tmp_path / OUTPUT)["/breaks/bond"].tolist() == right["/breaks/bond"].tolist()
    else:
        assert result.returncode == 1 and result.stderr.count("\n") == 1
        assert result.stderr.startswith("crackle: ")
