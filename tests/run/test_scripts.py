"""The scripts of postprocess run from any folder, and say it when the python3 that runs them lacks a module."""
import os
import subprocess
import sys
import venv
from pathlib import Path

import pytest

SCRIPTS = Path(__file__).resolve().parents[2] / "postprocess"
NAMES = ("compare.py", "export_xdmf.py", "figures.py", "report.py", "sample.py", "stability.py")


def call(name, folder, *pythons, **variables):
    """`name --help` by the first python3 of the folders `pythons`, as a shell would start it."""
    path = os.pathsep.join(map(str, pythons))
    environment = {**os.environ, "PATH": path, "MPLCONFIGDIR": str(folder), "PYTHONDONTWRITEBYTECODE": "1", **variables}
    return subprocess.run([SCRIPTS / name, "--help"], cwd=folder, env=environment, capture_output=True, text=True,
                          timeout=60, check=False)


@pytest.fixture(scope="module", name="bare")
def bare_python(tmp_path_factory):
    """A folder whose python3 has the standard library alone."""
    folder = tmp_path_factory.mktemp("bare")
    venv.create(folder, symlinks=True)
    return folder / "bin"


@pytest.fixture(scope="module", name="able")
def able_python(tmp_path_factory):
    """A folder whose python3 is the one that runs this test."""
    folder = tmp_path_factory.mktemp("able")
    (folder / "python3").write_text(f'#!/bin/sh\nexec {sys.executable} "$@"\n')
    (folder / "python3").chmod(0o755)
    return folder


def test_these_are_all_scripts():
    assert sorted(path.name for path in SCRIPTS.glob("*.py") if path.name != "setup.py") == list(NAMES)


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("safe", ["", "1"])
def test_script_runs_from_another_folder(tmp_path, able, name, safe):
    result = call(name, tmp_path, able, PYTHONSAFEPATH=safe)
    assert result.returncode == 0, result.stderr
    assert result.stdout.startswith(f"usage: {name}") and not result.stderr


@pytest.mark.parametrize("name", NAMES)
def test_python_without_the_modules_is_told_which_has_them(tmp_path, bare, able, name):
    result = call(name, tmp_path, bare, able)
    assert (result.returncode, result.stdout, result.stderr.count("\n")) == (1, "", 1), result.stderr
    begin, end = result.stderr.split(" lacks ")
    assert begin == f"{name}: {bare / 'python3'}"
    assert end.startswith("h5py, ") and "numpy" in end and end.endswith(f"; {able / 'python3'} has them\n")


def test_one_module_that_no_python_has_is_told_by_its_package(tmp_path, able):
    (tmp_path / "matplotlib.py").write_text("raise ValueError('built for another\\nnumpy')\n")
    result = call("sample.py", tmp_path, able, PYTHONPATH=str(tmp_path))
    assert (result.returncode, result.stdout) == (1, "")
    assert result.stderr == (f"sample.py: {sys.executable} lacks matplotlib; no python3 on PATH has it; "
                             "Debian's packages: python3-matplotlib\n")


def test_script_that_needs_no_matplotlib_runs_without(tmp_path, able):
    (tmp_path / "matplotlib.py").write_text("raise ImportError\n")
    assert call("export_xdmf.py", tmp_path, able, PYTHONPATH=str(tmp_path)).returncode == 0
