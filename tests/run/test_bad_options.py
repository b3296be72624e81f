"""A mistake on the command line ends in one line that tells how to mend it, and touches no file."""
import shlex

import pytest
from program import OUTPUT, break_samples, datasets, options_of, refuse, run, succeed

MISSPELT = [
    ("-latice_size 4", "-latice_size", "-lattice_size"),
    ("--lattice_size 4", "--lattice_size", "-lattice_size"),
    ("-sample 4", "-sample", "-samples"),
    ("-break_onn tension", "-break_onn", "-break_on"),
    ("-recrod none", "-recrod", "-record"),
]

# option, values that are refused, one word of what is allowed
VALUES = [
    ("-model", ["fuses", "1", "spring,fuse"], "spring or fuse"),
    ("-lattice", ["hexagonal", "0"], "triangular"),
    ("-lattice_size", ["0", "-1", "8.5", "abc", "1e2", "4x", "nan", "99999999999999999999"], "from 1"),
    ("-lattice_size", ["4,0", "4,,5", "4,", ",4", "4,4"], "-lattice_size"),
    ("-lattice_size 4,5 -samples", ["1,2,3", "1,", "1,x", "2,0"], "from 1"),
    ("-lattice_size 4,5 -first_sample", ["1,2,3", "1,-1"], "from 0"),
    ("-lattice_size 4,5 -seed", ["1,2,3", "1,-1", "1,"], "from 0"),
    ("-ensemble_ranks_per_sample", ["0", "-1", "2", "1.5", "x"], "number of processes"),
    ("-checkpoint_every", ["-1", "x", "nan"], "seconds"),
    ("-checkpoint_breaks", ["-1", "1.5", "x"], "an integer from 0"),
    ("-lattice_row_spacing", ["0", "-1", "abc", "nan", "inf", "1e999", "1,5", "0x1", "1e-51", "1e51", "1e200"], "from 1e-50 to 1e50"),
    ("-stiffness random -stiffness_contrast", ["0", "0.9", "x", "1e101", "inf"], "from 1 to 1e100"),
    ("-grips", ["glued", "1"], "sliding or clamped"),
    ("-break_on", ["compression"], "magnitude or tension"),
    ("-disorder", ["gauss", "1"], "uniform"),
    ("-seed", ["-1", "1.5", "abc", "18446744073709551616"], "an integer from 0"),
    ("-samples", ["0", "-3", "2.5", "abc", "1e3", "9223372036854775808"], "from 1"),
    ("-first_sample", ["-1", "0.5", "abc", "9223372036854775808"], "an integer from 0"),
    ("-stop", ["peak", "breaks", "breaks=", "breaks=-1", "breaks=1.5", "breaks=x", "stiffness=2",
               "stiffness=-0.1", "stiffness=nan", "displacement=-1", "displacement=inf", "displacement",
               "failure=1", "=", "=3"], "breaks=n"),
    ("-equilibrium", ["banana", "ksp,dense"], "ksp"),
    ("-equilibrium_tree_kernels", ["sse9", "PLAIN", "plain,avx2", "0"], "plain (what this processor has)"),
    ("-equilibrium_tree_precision", ["half", "Single", "1", "single,double"], "single or double"),
    ("-equilibrium_tree_threads", ["0", "-1", "257", "x", "1.5", "1e9", "2,3", "2147483648"], "an integer from 1 to 256"),
    ("-resume", ["perhaps"], "true or false"),
    ("-record", ["bond", "none,breaks", "breaks;profile", ","], "none, or any of breaks, profile, snapshot"),
    ("-record snapshot -record_snapshot_at", ["0", "-1", "x", "1,x", "1.5", "1,,2"], "from 1"),
    ("-record profile -record_profile_height", ["0", "-1", "x", "inf", "nan"], "above 0"),
    ("-monitor", ["loud", "0"], "none"),
]

# of PETSc's solvers: what PETSc takes without a word
SOLVER_VALUES = [
    ("-ksp_rtol", ["nan", "inf", "-inf", "-1", "1", "2", "1e400", "1e", "0x1p-3", "''", "PETSC_DEFAULT", "default"],
     "from 0 to below 1"),
    ("-ksp_atol", ["nan", "inf", "-nan", "-1e-9", "1", "1e", "''", "default"], "from 0 to below 1"),
    ("-ksp_divtol", ["nan", "inf", "0", "-1", "1", "1e400", "''"], "above 1"),
    ("-ksp_max_it", ["-5", "0", "nan", "1e3", "0x10", "99999999999", "2147483648", "''", "default"],
     "from 1 to 2147483647"),
    ("-pc_type icc -pc_factor_shift_type nonzero -pc_factor_shift_amount", ["nan", "inf", "1e400"], "a finite number"),
    ("-pc_type icc -pc_factor_fill", ["nan", "-inf"], "a finite number"),
    ("-pc_type gamg -mg_levels_pc_sor_diagonal_shift", ["nan"], "a finite number"),
    ("-pc_type cholesky -pc_factor_mat_solver_type mumps -mat_mumps_cntl_1", ["nan", "inf"], "a finite number"),
]

USELESS = [
    ("-lattice_file network.h5", "-lattice_file"),
    ("-record_snapshot_at 3", "-record_snapshot_at"),
    ("-record none -record_snapshot_at 3", "-record_snapshot_at"),
    ("-equilibrium dense -ksp_type cg", "-ksp_type"),
    ("-equilibrium ksp -equilibrium_tree_kernels plain", "-equilibrium_tree_kernels"),
    ("-equilibrium ksp -equilibrium_tree_precision double", "-equilibrium_tree_precision"),
    ("-equilibrium ksp -equilibrium_tree_threads 2", "-equilibrium_tree_threads"),
    ("-equilibrium dense -pc_type updown", "-pc_type"),
    ("-equilibrium quad -equilibrium_check 5", "-equilibrium_check"),
    ("-equilibrium_check_bound 1e-9", "-equilibrium_check_bound"),
    ("-pc_type updown -pc_factor_mat_solver_type mumps", "-pc_factor_mat_solver_type"),
    ("-ksp_rtol 1e-9", "-ksp_rtol"),  # no use under -ksp_type preonly
]


@pytest.mark.parametrize("line, name, meant", MISSPELT)
def test_misspelt_option_is_named_with_the_one_that_was_meant(tmp_path, line, name, meant):
    refuse(tmp_path, line, f" {name} ", f"did you mean {meant}?")


@pytest.mark.parametrize("line", ["-temperature 3", "-temperature", "-ksp_typo cg", "-log_veiw", "-helpp"])
def test_unknown_option_is_named(tmp_path, line):
    refuse(tmp_path, line, shlex.split(line)[0])


@pytest.mark.parametrize("option, value, allowed",
                         [(option, value, allowed) for option, values, allowed in VALUES for value in values])
def test_value_that_is_not_allowed(tmp_path, option, value, allowed):
    refuse(tmp_path, f"{option} {value}", option.split()[-1], value, allowed)


@pytest.mark.parametrize("option, value, allowed",
                         [(option, value, allowed) for option, values, allowed in SOLVER_VALUES for value in values])
def test_number_that_no_solver_can_use(tmp_path, option, value, allowed):
    refuse(tmp_path, f"-lattice_size 3 -ksp_type cg {option} {value}", option.split()[-1], value.strip("'"), allowed)


def test_solver_options_from_a_file_have_the_same_range(tmp_path):
    (tmp_path / "solver.opts").write_text("-ksp_type cg\n-pc_type jacobi\n-ksp_rtol -nan\n")
    refuse(tmp_path, "-options_file solver.opts", "-ksp_rtol -nan", "solver.opts, line 3")


def test_option_refused_from_yaml_is_told_with_its_file(tmp_path, monkeypatch):
    (tmp_path / "scene.yaml").write_text("lattice_size: 0\n")
    refuse(tmp_path, "-options_file_yaml scene.yaml", "-lattice_size 0", "(it stands in options file scene.yaml)")
    refuse(tmp_path, "-options_file scene.yaml", "-lattice_size 0", "(it stands in options file scene.yaml)")
    assert "stands in" not in refuse(tmp_path, "-options_file_yaml scene.yaml -lattice_size x", "-lattice_size x")
    (tmp_path / "scene.yaml").write_text("lattice: file\n")
    assert "stands in" not in refuse(tmp_path, "-options_file_yaml scene.yaml", "-lattice_file not given")
    monkeypatch.setattr("program.environment", lambda: {"PETSC_OPTIONS_YAML": "seed: -1"})
    refuse(tmp_path, "-lattice_size 2", "-seed -1", "(it stands in PETSC_OPTIONS_YAML)")


@pytest.mark.parametrize("line", ["-ksp_rtol 1e-13 -ksp_atol 0 -ksp_divtol 1e30 -ksp_max_it 1000", "-ksp_rtol 1e-320",
                                  "-ksp_atol 1e-14 -ksp_rtol 0", "-ksp_rtol -0"])
def test_numbers_that_a_solver_can_use(tmp_path, line):
    right = break_samples(tmp_path, "-lattice_size 3", "right.h5")
    found = break_samples(tmp_path, f"-lattice_size 3 -ksp_type cg -pc_type jacobi {line}")
    assert found["/breaks/bond"].tolist() == right["/breaks/bond"].tolist()


@pytest.mark.parametrize("option", ["-model", "-lattice_size", "-seed", "-stop", "-record", "-monitor"])
def test_option_without_its_value(tmp_path, option):
    refuse(tmp_path, option, option, "allowed is")
    refuse(tmp_path, f"{option} ''", option, "allowed is")


@pytest.mark.parametrize("line, name", USELESS)
def test_option_of_no_use_in_the_scene(tmp_path, line, name):
    refuse(tmp_path, line, f" {name} ")


@pytest.mark.parametrize("line, word", [("triangular", "triangular"), ("-lattice_size 4 5", " 5"),
                                        ("-lattice_size 4 seed 3", "seed"), ("- -lattice_size 4", " -")])
def test_stray_word(tmp_path, line, word):
    refuse(tmp_path, line, word, "allowed is")


@pytest.mark.parametrize("line, words", [
    ("-lattice file", ["-lattice_file", "HDF5"]),
    ("-record snapshot", ["-record_snapshot_at", "from 1"]),
    ("-disorder file", ["-disorder", "-lattice file"]),
    ("-resume", ["-overwrite", "-resume"]),
])
def test_option_that_needs_or_excludes_another(tmp_path, line, words):
    refuse(tmp_path, line, *words)


def test_more_samples_than_numbers(tmp_path):
    """The last sample's number must be one."""
    refuse(tmp_path, "-lattice_size 1 -first_sample 9223372036854775807 -samples 2", "sample")


def test_options_file_that_is_not_there(tmp_path):
    refuse(tmp_path, "-options_file scene.opts", "options file", "scene.opts")


@pytest.mark.parametrize("text, word", [(b"lattice_size 4\n", "lattice_size"), (b"-lattice_size 4 5\n", "5"),
                                        (b"\x89HDF\r\n\x1a\n\x00", "scene.opts")])
def test_options_file_with_garbage(tmp_path, text, word):
    (tmp_path / "scene.opts").write_bytes(text)
    refuse(tmp_path, "-options_file scene.opts", "scene.opts", word)


def test_options_file_with_a_misspelt_option(tmp_path):
    (tmp_path / "scene.opts").write_text("# a scene\n-lattice_sise 4\n")
    refuse(tmp_path, "-options_file scene.opts", "-lattice_sise", "did you mean -lattice_size?")


@pytest.mark.parametrize("option", ["-pc_type", "-ksp_type", "-mat_type",
                                    "-pc_type cholesky -pc_factor_mat_solver_type"])
def test_petsc_type_that_does_not_exist(tmp_path, option):
    refuse(tmp_path, f"{option} nonsense", option.split()[-1], "nonsense")


@pytest.mark.parametrize("line", ["-ksp_type cg -ksp_rtol abc", "-ksp_type cg -ksp_max_it 1.5",
                                  "-pc_updown_rank 0", "-pc_updown_rank x", "-pc_updown_rank 2"])
def test_petsc_value_that_is_not_allowed(tmp_path, line):
    option, value = line.split()[-2:]
    refuse(tmp_path, line, option, value)


def test_options_named_in_capitals_are_the_same_options(tmp_path):
    """PETSc takes no notice of case: what has an effect stands in the file."""
    succeed(tmp_path, "-LATTICE_SIZE 2 -KSP_TYPE cg -monitor none")
    options = {name.lower(): value for name, value in options_of(tmp_path / OUTPUT).items()}
    assert options["-lattice_size"] == "2"
    assert options["-ksp_type"] == "cg"


def test_exponent_that_doubles_cannot_hold(tmp_path):
    """Thresholds that become 0 would break by number. What is allowed depends on the smallest number drawn."""
    scene = "-lattice_size 3 -model fuse -seed 5 -disorder power -disorder_exponent"
    message = refuse(tmp_path, f"{scene} 500", "-disorder_exponent 500", "sample 0")
    most = float(message.split("up to ")[1].split()[0])
    refuse(tmp_path, f"{scene} {1.01 * most}", "-disorder_exponent", "sample 0")
    succeed(tmp_path, f"{scene} {0.99 * most} -overwrite")
    failed = run(tmp_path, f"{scene} {0.99 * most} -samples 200 -overwrite -monitor none")
    assert failed.returncode == 1 and "-disorder_exponent" in failed.stderr and "for sample" in failed.stderr
    finished = len(datasets(tmp_path / OUTPUT)["/samples/index"]) if (tmp_path / OUTPUT).exists() else 0
    assert finished > 0 or list(tmp_path.glob(OUTPUT + "*")), "samples that were finished before are kept"
