"""postprocess/README.md: its commands and its Python, run as they stand there."""
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest
from program import CRACKLE, environment

PROJECT = Path(__file__).resolve().parents[2]
COMPARE = os.environ.get("CRACKLE_COMPARE", str(Path(CRACKLE).with_name("crackle_compare")))
README = PROJECT / "postprocess" / "README.md"
LEAVES = ("sample.png", "figures/response.pdf", "figures/damage_peak_cdf.png", "report/index.html", "crack.xdmf",
          "crack_data.h5", "figures/work_precision.png", "stability/stability.md")


def blocks(kind):
    return re.findall(rf"^```{kind}\n(.*?)^```$", README.read_text(encoding="utf-8"), re.M | re.S)


def run(folder, command, text):
    """Runs a text by a command that reads it, with this python3 first on PATH."""
    (folder / "bin").mkdir(exist_ok=True)
    (folder / "bin" / "python3").write_text(f'#!/bin/sh\nexec {sys.executable} "$@"\n')
    (folder / "bin" / "python3").chmod(0o755)
    path = os.pathsep.join([str(folder / "bin"), os.environ["PATH"]])
    variables = {**environment(), "PATH": path, "PYTHONPATH": "postprocess", "MPLCONFIGDIR": str(folder / "matplotlib")}
    return subprocess.run(command, cwd=folder, env=variables, input=text, capture_output=True, text=True, timeout=200,
                          check=False)


@pytest.fixture(scope="module", name="project")
def project_folder(tmp_path_factory):
    """A folder that looks like the project's, built."""
    folder = tmp_path_factory.mktemp("project")
    (folder / "build" / "release").mkdir(parents=True)
    for place, there in (("build/release/crackle", CRACKLE), ("build/release/crackle_compare", COMPARE),
                         ("postprocess", PROJECT / "postprocess"), ("options", PROJECT / "options")):
        (folder / place).symlink_to(there)
    return folder


def test_commands_and_python_do_what_they_say(project):
    commands, = blocks("sh")
    scripts = {path.name for path in (PROJECT / "postprocess").glob("*.py")} - {"setup.py"}
    assert set(re.findall(r"^postprocess/(\S+)", commands, re.M)) == scripts
    result = run(project, ["sh", "-ex"], commands)
    assert result.returncode == 0, result.stderr
    assert [name for name in LEAVES if not (project / name).is_file()] == []
    program, = blocks("python")
    result = run(project, [sys.executable, "-"], program + "\nassert ends.shape == (run.n_f[0], 2, 2)\n")
    assert result.returncode == 0 and result.stdout.startswith("16 2."), result.stderr
