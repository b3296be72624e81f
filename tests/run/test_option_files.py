"""Options files and PETSC_OPTIONS: what PETSc takes is taken; what it would skip, cut or crash on is refused, with its
place."""
import subprocess

import pytest
from networks import small_network
from program import CRACKLE, break_samples, contents, environment, execute, options_of, refuse, succeed

GOOD = "-lattice_size 2\n"
REFUSED = {  # what follows GOOD: words of the message
    "two_options": (b"-seed 7 -samples 2\n", ["scene.opts, line 2", "-seed 7 -samples 2", "one option a line"]),
    "two_values": (b"-seed 7 8\n", ["scene.opts, line 2", "one option a line"]),
    "carriage_return_alone": (b"-seed 7\r-samples 2\n", ["scene.opts, line 2", "one option a line"]),
    "no_option": (b"\n# x\nseed 7\n", ["scene.opts, line 4", "seed 7"]),
    "semicolon": (b"; a comment\n", ["scene.opts, line 2"]),
    "open_quote": (b'-output "a.h5\n-seed 3\n', ["scene.opts, line 2", "quote"]),
    "quote_within": (b'-output a"b.h5\n', ["scene.opts, line 2", "quotes"]),
    "comment_or_not": (b"-output a#b.h5\n", ["scene.opts, line 2", "comments after a space"]),
    "alias_of_one": (b"alias -sd\n", ["scene.opts, line 2"]),
    "missing_include": (b"-options_file other.opts\n", ["scene.opts, line 2", "other.opts", "No such file"]),
    "include_of_nothing": (b"-options_file\n", ["scene.opts, line 2", "without a value"]),
    "include_of_a_folder": (b"-options_file .\n", ["scene.opts, line 2", "not a folder"]),
    "include_of_a_device": (b"-options_file /dev/zero\n", ["scene.opts, line 2", "/dev/zero", "pipe or device"]),
    "itself": (b"-options_file scene.opts\n", ["scene.opts, line 2", "doesn't include itself"]),
    "itself_by_another_name": (b"-options_file ./a/../scene.opts\n", ["scene.opts, line 2", "include itself"]),
    "many_names": ("".join(f"-mat_x{i} 1\n" for i in range(600)).encode(), ["scene.opts, line 50", "-mat_x49", "at most 500"]),
    "many_aliases": ("".join(f"alias -x{i} -seed\n" for i in range(30)).encode(), ["line 27", "at most 25 aliases"]),
    "zeros": (b"\0\0\n", ["scene.opts", "bytes that are 0"]),
}


@pytest.mark.parametrize("name", REFUSED)
def test_options_file_that_is_refused(tmp_path, name):
    more, words = REFUSED[name]
    (tmp_path / "a").mkdir()
    (tmp_path / "scene.opts").write_bytes(GOOD.encode() + more)
    refuse(tmp_path, "-options_file scene.opts", *words)
    (tmp_path / "outer.opts").write_text("-options_file scene.opts\n")
    refuse(tmp_path, "-options_file outer.opts", *words)


@pytest.mark.parametrize("codec, word", [("utf-8-sig", "byte order mark"), ("utf-16", "UTF-16"),
                                         ("utf-16-le", "bytes that are 0")])
def test_options_file_in_another_encoding(tmp_path, codec, word):
    (tmp_path / "scene.opts").write_bytes(GOOD.encode(codec))
    refuse(tmp_path, "-options_file scene.opts", "options file scene.opts", word)


def test_two_files_that_include_each_other(tmp_path):
    for one, other in ("ab", "ba"):
        (tmp_path / one).write_text(f"{GOOD}-options_file {other}\n")
    refuse(tmp_path, "-options_file a", "options file b, line 2", "-options_file a", "include itself")


ACCEPTED = {
    "spaces": "   -seed    7   ", "tabs": "\t-seed\t7\t", "windows": "-seed 7\r\n-model fuse\r", "quotes": '-seed "7"',
    "comment": "# -seed 3\n-seed 7 # -seed 4\n-samples 1#", "alias": "alias -number -seed\n-number 7",
    "include": "-options_file more.opts", "include_twice": "-options_file more.opts\n-options_file more.opts",
    "include_nothing": "-seed 7\n-options_file /dev/null", "no_newline": "-seed 7", "capitals": "-SEED 7",
    "nested": "-options_file outer.opts", "later_counts": "-seed 3\n-seed 7", "flag": "-seed 7\n-overwrite",
}


@pytest.mark.parametrize("name", ACCEPTED)
def test_options_file_that_petsc_takes(tmp_path, name):
    (tmp_path / "more.opts").write_text("-seed 7\n")
    (tmp_path / "outer.opts").write_text("-options_file more.opts\n")
    (tmp_path / "scene.opts").write_bytes((GOOD + ACCEPTED[name]).encode())
    succeed(tmp_path, "-options_file scene.opts -monitor none")
    used = options_of(tmp_path / "crackle.h5")
    assert (used["-seed"], used["-lattice_size"]) == ("7", "2")


def test_value_with_spaces(tmp_path):
    (tmp_path / "scene.opts").write_text(GOOD + '-output "a b.h5" # quoted\n')
    succeed(tmp_path, "-options_file scene.opts -monitor none")
    assert (tmp_path / "a b.h5").exists()


def test_yaml_is_petscs_to_read(tmp_path):
    (tmp_path / "scene.yml").write_text("seed: 7\nlattice_size: 2\n")
    succeed(tmp_path, "-options_file scene.yml -monitor none")
    assert options_of(tmp_path / "crackle.h5")["-seed"] == "7"


def refused_with(folder, line, *words, **more):
    """Options from the environment: what is said instead of a run."""
    result = subprocess.run([CRACKLE, *line.split()], cwd=folder, env={**environment(), **more}, text=True,
                            capture_output=True, timeout=60, check=False)
    assert result.returncode == 1 and result.stderr.count("\n") == 1 and result.stdout == "", result
    missing = [word for word in words if word not in result.stderr]
    assert not missing, f"{missing} not in: {result.stderr}"


def test_a_refusal_names_where_the_option_came_from(tmp_path):
    (tmp_path / "scene.opts").write_text(GOOD + "-dm_refine 2\n-seed x\n")
    line = "-lattice_size 2"
    refused_with(tmp_path, "-options_file scene.opts", "-seed x", "options file scene.opts, line 3")
    refused_with(tmp_path, "-options_file scene.opts -seed 1", "-dm_refine 2", "options file scene.opts, line 2")
    refused_with(tmp_path, line, "-dm_refine 3", "PETSC_OPTIONS", PETSC_OPTIONS="-dm_refine 3")
    for name in (".petscrc", "petscrc"):
        (tmp_path / name).write_text("-dm_refine 2\n")
        refused_with(tmp_path, line, "-dm_refine 2", f"options file {name}, line 1")
        (tmp_path / name).unlink()
    (tmp_path / "home").mkdir()
    (tmp_path / "home" / ".petscrc").write_text("\n-dm_refine 2\n")
    refused_with(tmp_path, line, "-dm_refine 2", "home/.petscrc, line 2", HOME=str(tmp_path / "home"))
    succeed(tmp_path, f"{line} -skip_petscrc")


def test_petsc_options_that_are_malformed(tmp_path):
    for value, word in (("seed 3", "seed"), ("-seed 3 4", "4"), ('-output "a b.h5', "quote"),
                        ("-options_file none.opts", "none.opts")):
        refused_with(tmp_path, "-lattice_size 2", "PETSC_OPTIONS", word, PETSC_OPTIONS=value)
    assert contents(tmp_path) == {}


def test_a_ksp_that_only_a_petscrc_wants_is_told(tmp_path):
    (tmp_path / ".petscrc").write_text("-ksp_monitor_true_residual\n")
    result = succeed(tmp_path, "-lattice_size 2 -monitor none -stop breaks=0")
    assert result.stderr.count("\n") == 1
    for word in ("-ksp_monitor_true_residual", ".petscrc, line 1", "ksp, not tree"):
        assert word in result.stderr
    for asked in ("-equilibrium ksp", "-equilibrium tree -skip_petscrc", "-ksp_type cg"):
        assert succeed(tmp_path, f"-lattice_size 2 -monitor none -overwrite -stop breaks=0 {asked}").stderr == ""


@pytest.mark.parametrize("where", ["command line", "file", "environment"])
def test_values_of_any_length(tmp_path, where):
    """PETSc's own ways of reading a value cut it at 4095 characters."""
    numbers = ",".join(map(str, range(1, 1101)))
    assert len(numbers) > 4095
    option = f"-record_snapshot_at {numbers}"
    (tmp_path / "scene.opts").write_text(option + "\n")
    line = {"command line": option, "file": "-options_file scene.opts", "environment": ""}[where]
    more = {"PETSC_OPTIONS": option} if where == "environment" else {}
    subprocess.run([CRACKLE, *f"-lattice_size 2 -monitor none -record snapshot {line}".split()], cwd=tmp_path,
                   env={**environment(), **more}, timeout=60, check=True, capture_output=True)
    assert options_of(tmp_path / "crackle.h5")["-record_snapshot_at"] == numbers


def test_a_network_file_with_a_long_path(tmp_path):
    """Beyond 4095 characters the system opens none; the path isn't another one, cut."""
    small_network().write(tmp_path / "network.h5")
    short = "./" * 1500 + "network.h5"
    break_samples(tmp_path, f"-lattice file -disorder file -lattice_file {short}")
    refuse(tmp_path, f"-lattice file -disorder file -lattice_file {'./' * 3000}network.h5", "HDF5 file")


def test_a_strategys_file(tmp_path):
    for text, word in (("-ksp_type cg -pc_type icc\n", "line 1"), ('-ksp_type "cg\n', "quote"),
                       ("\ufeff-ksp_type cg\n", "byte order mark"), ("-options_file s.opts\n", "include itself")):
        (tmp_path / "s.opts").write_text(text)
        result = execute(tmp_path, "crackle_compare -lattice_size 2 -compare s.opts")
        assert result.returncode == 1 and result.stderr.count("\n") == 1, result.stderr
        assert word in result.stderr and "s.opts" in result.stderr


def test_includes_without_end(tmp_path):
    """Two includes in each of forty files would be a million million files."""
    for i in range(40):
        (tmp_path / f"{i}.opts").write_text(f"-options_file {i + 1}.opts\n" * 2)
    (tmp_path / "40.opts").write_text(GOOD)
    refuse(tmp_path, "-options_file 0.opts", "at most 500 options files")
    for i in range(480):
        (tmp_path / f"{i}.opts").write_text(f"-options_file {i + 1}.opts\n")
    (tmp_path / "480.opts").write_text(GOOD)
    succeed(tmp_path, "-options_file 0.opts -monitor none -overwrite")
