"""cmake --install: what lands where, and that it works there, with nothing of the folder that it was built in."""
import os
import re
import shlex
import stat
import subprocess
import sys
from pathlib import Path

import pytest
from program import CRACKLE, environment
from readme import dead_links

PROJECT = Path(__file__).resolve().parents[2]
BUILD = Path(CRACKLE).parent
SHARE, DOCUMENTS = "share/crackle", "share/doc/crackle"
SCRIPTS = sorted(path.name for path in (PROJECT / "postprocess").glob("*.py") if path.name != "setup.py")
TEXTS = ("README.md", "LICENSE", "CHANGELOG.md", "options/README.md", "postprocess/README.md", "src/README.md",
         "tests/README.md")
MAY_BE = ("CITATION.cff",)


def execute(command, folder, **more):
    found = {name: value for name, value in environment().items() if name not in ("PYTHONPATH", "DESTDIR")}
    return subprocess.run(list(map(str, command)), cwd=folder, env={**found, "PYTHONDONTWRITEBYTECODE": "1", **more},
                          stdin=subprocess.DEVNULL, capture_output=True, text=True, timeout=120, check=False)


def install(folder, *words, **more):
    result = execute([os.environ.get("CRACKLE_CMAKE", "cmake"), "--install", BUILD, *words], folder, **more)
    assert result.returncode == 0, result.stderr


def files_of(folder):
    return {path.relative_to(folder).as_posix() for path in folder.rglob("*") if not path.is_dir()}


def below(folder, *patterns):
    return [path.relative_to(PROJECT / folder).as_posix()
            for pattern in patterns for path in (PROJECT / folder).glob(pattern)]


@pytest.fixture(scope="module", name="prefix")
def installed_once(tmp_path_factory):
    prefix = tmp_path_factory.mktemp("install") / "a prefix"
    install(prefix.parent, "--prefix", prefix)
    return prefix


def test_all_that_is_needed_and_nothing_else(prefix):
    assert files_of(prefix) == {
        *(f"bin/{program}" for program in ("crackle", "crackle_merge", "crackle_compare")),
        *(f"{SHARE}/options/{name}" for name in below("options", "**/*.opts")),
        *(f"{SHARE}/postprocess/{name}" for name in SCRIPTS),
        *(f"{SHARE}/postprocess/crackle/{name}"
          for name in below("postprocess/crackle", "**/*.py", "**/*.csv", "**/*.css", "**/*.js")),
        *(f"{DOCUMENTS}/{name}" for name in TEXTS),
        *(f"{DOCUMENTS}/postprocess/pictures/{name}" for name in below("postprocess/pictures", "*.png")),
        *(f"{DOCUMENTS}/{name}" for name in MAY_BE if (PROJECT / name).exists())}
    executable = {path.relative_to(prefix).as_posix() for path in prefix.rglob("*")
                  if path.is_file() and path.stat().st_mode & stat.S_IXUSR}
    assert executable == {name for name in files_of(prefix) if name.startswith("bin/") or Path(name).name in SCRIPTS
                          and Path(name).parent.name == "postprocess"}


def test_links_of_texts_hold(prefix):
    assert {name: dead_links(prefix / DOCUMENTS / name) for name in TEXTS} == {name: [] for name in TEXTS}


def test_nothing_leads_back_to_where_it_was_built(prefix):
    for path in prefix.rglob("*"):
        assert not path.is_symlink()
        if path.is_file() and path.parent.name != "bin":
            assert str(PROJECT).encode() not in path.read_bytes(), path
    for program in (prefix / "bin").iterdir():
        head = execute(["readelf", "-d", program], prefix).stdout
        assert "NEEDED" in head and str(PROJECT) not in head and str(BUILD) not in head


def demo(prefix):
    """The lines of bootstrap.sh demo that run something, as they read after an installation."""
    body = re.search(r"^demo\(\) \{\n(.*?)^\}", (PROJECT / "bootstrap.sh").read_text(encoding="utf-8"), re.M | re.S)[1]
    for line in body.replace("  setup\n", "").splitlines():
        words = shlex.split(line)
        for old, new in (("build/release/", "bin/"), ("options/", f"{SHARE}/options/"),
                         ("postprocess/", f"{SHARE}/postprocess/")):
            words = [str(prefix / (new + word.removeprefix(old))) if word.startswith(old) else word for word in words]
        yield [sys.executable if word == "/usr/bin/python3" else word for word in words]


def test_the_demo_runs_from_another_folder(tmp_path, prefix):
    broken, drawn = demo(prefix)
    result = execute(broken, tmp_path)
    assert result.returncode == 0 and "20 samples" in result.stdout, result.stderr
    result = execute(drawn, tmp_path)
    assert result.returncode == 0, result.stderr
    assert (tmp_path / "crackle.png").read_bytes().startswith(b"\x89PNG")
    assert files_of(tmp_path) == {"crackle.h5", "crackle.png"}
    assert not list(prefix.rglob("__pycache__"))


def test_the_scripts_are_those_of_the_installation(tmp_path, prefix):
    """Each explains itself, and takes the package beside it. (In one process, which loads matplotlib once.)"""
    program = """if True:
        import runpy, sys
        before = list(sys.path)
        for script in sys.argv[1:]:
            sys.argv, sys.path = [script, "--help"], before.copy()
            for name in [name for name in sys.modules if name.split(".")[0] == "crackle"]:
                del sys.modules[name]
            try:
                runpy.run_path(script, run_name="__main__")
            except SystemExit as end:
                print(end.code, sys.modules["crackle"].__file__)
    """
    folder = prefix / SHARE / "postprocess"
    result = execute([sys.executable, "-c", program, *(folder / name for name in SCRIPTS)], tmp_path)
    lines = result.stdout.splitlines()
    for name in SCRIPTS:
        assert any(line.startswith(f"usage: {name} ") for line in lines), (name, result.stderr)
    assert lines.count(f"0 {folder / 'crackle/__init__.py'}") == len(SCRIPTS) > 5


def test_stability_finds_program_and_solvers(tmp_path, prefix):
    scene = tmp_path / "small.opts"
    scene.write_text("-lattice_size 3\n-model fuse\n", encoding="utf-8")
    result = execute([sys.executable, prefix / SHARE / "postprocess/stability.py", scene, "-o", "out"], tmp_path)
    assert result.returncode == 0, result.stderr
    table = (tmp_path / "out/stability.md").read_text(encoding="utf-8")
    assert "`tree`" in table and "`mumps`" in table and "| `small` |" in table


def test_once_more_and_elsewhere(tmp_path, prefix):
    before = files_of(prefix)
    (prefix / "bin/crackle").write_bytes(b"an old version")
    install(tmp_path, "--prefix", prefix)
    assert files_of(prefix) == before
    assert execute([prefix / "bin/crackle", "--version"], tmp_path).stdout.startswith("crackle")

    install(tmp_path, "--prefix", "/opt/crackle-of-a-test", DESTDIR=str(tmp_path / "stage"))
    assert files_of(tmp_path / "stage/opt/crackle-of-a-test") == before
    assert not Path("/opt/crackle-of-a-test").exists()

    install(tmp_path, "--prefix", tmp_path / "part", "--component", "programs")
    assert files_of(tmp_path / "part") == {name for name in before if name.startswith("bin/")}
