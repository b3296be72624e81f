"""postprocess/README.md: its commands and its Python, run as they stand there."""
import re
import sys

import pytest
from readme import PROJECT, blocks, make_project, run_block

README = PROJECT / "postprocess" / "README.md"
LEAVES = ("sample.png", "figures/response.pdf", "figures/damage_peak_cdf.png", "report/index.html", "crack.xdmf",
          "crack_data.h5", "figures/work_precision.png", "stability/stability.md")


@pytest.fixture(scope="module", name="project")
def project_folder(tmp_path_factory):
    return make_project(tmp_path_factory.mktemp("project"))


def test_commands_and_python_do_what_they_say(project, monkeypatch):
    monkeypatch.setenv("PYTHONPATH", "postprocess")
    commands, = blocks(README, "sh")
    scripts = {path.name for path in (PROJECT / "postprocess").glob("*.py")} - {"setup.py"}
    assert set(re.findall(r"^postprocess/(\S+)", commands, re.M)) == scripts
    result = run_block(project, ["sh", "-ex"], commands)
    assert result.returncode == 0, result.stderr
    assert [name for name in LEAVES if not (project / name).is_file()] == []
    program, = blocks(README, "python")
    result = run_block(project, [sys.executable, "-"], program + "\nassert ends.shape == (run.n_f[0], 2, 2)\n")
    assert result.returncode == 0 and result.stdout.startswith("16 2."), result.stderr
