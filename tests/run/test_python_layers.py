"""The layers of postprocess/crackle, read from its import lines: what runs upwards, and who imports a script.

Scripts (postprocess/*.py) stand above all; `needs` stands below all, so that it runs where nothing is installed.
"""
import ast
import sys
from pathlib import Path

import pytest

POSTPROCESS = Path(__file__).resolve().parents[2] / "postprocess"
LAYERS = ("needs", "files", "statistics", "study", "figures", "page", "script")  # from bottom to top
PLAIN = ("needs",)  # these import the standard library alone


def imports(path):
    """Every module that a file imports, anywhere in it, by its full name."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            if node.level:
                yield "." * node.level + (node.module or "")  # relative: wrong wherever it stands
            elif node.module == "crackle":
                yield from (f"crackle.{alias.name}" for alias in node.names)
            else:
                yield node.module


def layer_of(path, folder):
    """Place in LAYERS of a file of `folder`, a copy of postprocess; None for crackle/__init__.py."""
    parts = path.relative_to(folder).with_suffix("").parts
    if parts[0] != "crackle":
        return LAYERS.index("script")
    return None if parts[1] == "__init__" else LAYERS.index(parts[1])


def wrong_imports(folder):
    """A line for each import that the rules forbid."""
    scripts = {path.stem for path in folder.glob("*.py")}
    found = []
    for path in sorted([*folder.glob("*.py"), *folder.glob("crackle/**/*.py")]):
        layer, who = layer_of(path, folder), path.relative_to(folder)
        for name in imports(path):
            root, *rest = name.split(".")
            if name.startswith("matplotlib.pyplot"):
                found.append(f"{who}: {name} has a backend and figures that belong to whoever imports the package")
            if not root:
                found.append(f"{who}: {name} is relative")
            elif root in scripts:
                found.append(f"{who}: {root} is a script")
            elif layer is None:
                found.append(f"{who}: {name}; it must import nothing")
            elif root == "crackle" and (not rest or LAYERS.index(rest[0]) > layer):
                found.append(f"{who}: {name} is above it")
            elif LAYERS[layer] in PLAIN and root not in sys.stdlib_module_names:
                found.append(f"{who}: {name} isn't of the standard library")
    return found


def others(path, folder, seen):
    """The modules of other projects that a file imports, by itself or through the package."""
    for name in imports(path):
        parts = name.split(".")
        if parts[0] != "crackle":
            seen.update({parts[0]} - set(sys.stdlib_module_names))
            continue
        for depth in range(1, len(parts) + 1):
            stem = folder.joinpath(*parts[:depth])
            for part in (stem.with_suffix(".py"), stem / "__init__.py"):
                if part.is_file() and part not in seen:
                    seen.add(part)
                    others(part, folder, seen)
    return sorted(module for module in seen if isinstance(module, str))


def needed(path):
    """What a script names to need()."""
    calls = [node for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))) if isinstance(node, ast.Call)]
    return [[argument.value for argument in call.args] for call in calls if getattr(call.func, "id", "") == "need"]


def test_no_import_runs_upwards():
    assert len(list(POSTPROCESS.glob("crackle/*/*.py"))) > 20
    assert not wrong_imports(POSTPROCESS)


def test_every_folder_is_a_layer():
    assert {path.parent.name for path in POSTPROCESS.glob("crackle/*/*.py")} == set(LAYERS) - {"needs", "script"}


@pytest.mark.parametrize("file, line", [
    ("crackle/files/run_file.py", "from crackle.statistics import bootstrap"),
    ("crackle/files/run_file.py", "    from crackle.study.ensembles import read_study"),
    ("crackle/statistics/scaling.py", "import crackle.figures.style"),
    ("crackle/study/tables.py", "from crackle import page"),
    ("crackle/figures/style.py", "import report"),
    ("crackle/page/viewer.py", "from ..figures import style"),
    ("crackle/figures/damage.py", "import matplotlib.pyplot as plt"),
    ("crackle/needs.py", "import numpy"),
    ("crackle/__init__.py", "from crackle.files import read_run"),
    ("report.py", "from sample import main"),
], ids=lambda value: value.strip().replace(" ", "_").replace("/", "."))
def test_a_planted_import_is_found(tmp_path, file, line):
    for path in POSTPROCESS.glob("**/*.py"):
        copy = tmp_path / path.relative_to(POSTPROCESS)
        copy.parent.mkdir(parents=True, exist_ok=True)
        copy.write_text(path.read_text(encoding="utf-8"), encoding="utf-8")
    planted = f"def planted():\n{line}\n" if line.startswith(" ") else f"{line}\n"
    with open(tmp_path / file, "a", encoding="utf-8") as copy:
        copy.write("\n\n" + planted)
    wrong = wrong_imports(tmp_path)
    assert len(wrong) == 1 and wrong[0].startswith(f"{file}: ")


@pytest.mark.parametrize("name", sorted(path.name for path in POSTPROCESS.glob("*.py") if path.name != "setup.py"))
def test_script_names_every_module_that_it_needs(name):
    assert needed(POSTPROCESS / name) == [others(POSTPROCESS / name, POSTPROCESS, set())]
