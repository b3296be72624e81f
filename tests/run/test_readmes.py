"""README files: links lead somewhere, and the first study is what one gets."""
import sys

import pytest
from readme import PROJECT, blocks, dead_links, make_project, run_block

FOLDERS = ("options", "postprocess", "src", "tests")
READMES = ["README.md", "CHANGELOG.md", *(f"{folder}/README.md" for folder in FOLDERS)]


@pytest.mark.parametrize("name", READMES)
def test_links_lead_somewhere(name):
    assert dead_links(PROJECT / name) == []


def test_dead_links_are_found(tmp_path):
    (tmp_path / "there.md").write_text("# A heading, of `code`\n```\n# none\n```\n")
    page = tmp_path / "page.md"
    page.write_text("[1](there.md) ![2](there.md#a-heading-of-code) [3](https://x.org/y)\n"
                    "[4](gone.md) [5](there.md#none)\n"
                    "# Own\n[6](#own) [7](#other)\n")
    assert dead_links(page) == ["gone.md", "there.md#none", "#other"]


def test_first_study(tmp_path):
    """A tenth of its samples, of which the first is the same."""
    project = make_project(tmp_path)
    study, = blocks(PROJECT / "README.md", "sh")
    assert " -samples 1000 " in study
    result = run_block(project, ["sh", "-ex"], study.replace(" -samples 1000 ", " -samples 100 "))
    assert result.returncode == 0, result.stderr
    assert [name for name in ("sample.png", "figures/size_effect.pdf") if not (project / name).is_file()] == []
    program, = blocks(PROJECT / "README.md", "python")
    result = run_block(project, [sys.executable, "-"], program)
    assert result.returncode == 0, result.stderr
    output, = (block for block in blocks(PROJECT / "README.md", "") if block.startswith("8 "))
    found, told = result.stdout.splitlines(), output.splitlines()
    assert [line.split()[0] for line in found[:-1]] == ["8", "16", "24", "32"]
    assert found[-1][:18] == told[-1][:18]  # three bonds
    for ours, theirs in zip(found[:-1], told[:-1]):
        assert float(ours.split()[1]) == pytest.approx(float(theirs.split()[1]), rel=0.05)
