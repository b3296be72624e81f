"""postprocess is a package that pip installs, without a network, from what Debian has."""
import os
import re
import subprocess
import venv
from pathlib import Path

import pytest
from program import OUTPUT, succeed

PROJECT = Path(__file__).resolve().parents[2]
POSTPROCESS = PROJECT / "postprocess"


def files_of(folder):
    """Path to content of all files, but for bytecode."""
    return {path.relative_to(folder): path.read_bytes() for path in folder.rglob("*")
            if path.is_file() and "__pycache__" not in path.parts}


def execute(command, folder):
    environment = {**os.environ, "PIP_CONFIG_FILE": os.devnull, "PYTHONDONTWRITEBYTECODE": "1"}
    return subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True, timeout=120,
                          check=False)


@pytest.fixture(scope="module", name="python")
def python_with_crackle(tmp_path_factory):
    """A python3 that sees the modules of the one that runs this test, and crackle besides."""
    folder = tmp_path_factory.mktemp("installed")
    venv.create(folder, system_site_packages=True, symlinks=True)
    python, before = folder / "bin" / "python3", files_of(POSTPROCESS)
    offline = ["--no-index", "--no-build-isolation", "--no-deps"]
    result = execute([python, "-m", "pip", "install", *offline, POSTPROCESS], folder)
    assert result.returncode == 0, result.stdout + result.stderr
    assert files_of(POSTPROCESS) == before  # building leaves nothing there
    return python


def installed_package(python, folder):
    result = execute([python, "-c", "import crackle; print(crackle.__path__[0])"], folder)
    assert result.returncode == 0, result.stderr
    return Path(result.stdout.strip())


def test_every_file_is_installed(tmp_path, python):
    package = installed_package(python, tmp_path)
    assert python.parents[1] in package.parents
    assert files_of(package) == files_of(POSTPROCESS / "crackle")


def test_installed_package_works_elsewhere(tmp_path, python):
    succeed(tmp_path, "-lattice_size 4 -samples 3 -monitor none")
    program = f"""if True:
        from crackle.files import read_run
        from crackle.page.markup import html_page, html_viewer
        from crackle.page.viewer import viewer_samples
        from crackle.study import paper, read_study
        study = read_study(["{OUTPUT}"])
        page = html_page(study, [("crack", html_viewer(viewer_samples(study)))])
        assert "spring L = 4 (3)" in page and "canvas" in page
        print(len(read_run("{OUTPUT}")), int(paper.spring_tables()["L"][0]), paper.exponents()["tau", "spring"])
    """
    result = execute([python, "-c", program], tmp_path)
    assert (result.stdout, result.stderr) == ("3 8 2.5\n", "")


def test_scripts_prefer_their_own_folder(tmp_path, python):
    needs = installed_package(python, tmp_path) / "needs.py"
    whole = needs.read_text(encoding="utf-8")
    needs.write_text("raise SystemExit('the installed one')\n", encoding="utf-8")
    try:
        result = execute([python, POSTPROCESS / "sample.py", "--help"], tmp_path)
        assert execute([python, "-c", "import crackle.needs"], tmp_path).stderr == "the installed one\n"
    finally:
        needs.write_text(whole, encoding="utf-8")
    assert result.returncode == 0 and result.stdout.startswith("usage: sample.py"), result.stderr


def test_version_is_the_programs():
    program = re.search(r"project\(crackle VERSION (\S+)", (PROJECT / "CMakeLists.txt").read_text(encoding="utf-8"))
    package = re.search(r'^version = "(\S+)"', (POSTPROCESS / "pyproject.toml").read_text(encoding="utf-8"), re.M)
    assert package[1] == program[1]
