"""The rooms of src and include, read from the #include lines: what runs upwards, and what lies in no room.

A file includes from its own room and from rooms above it in the table, and declares no type of others. Strategies don't
know each other.
"""
import contextlib
import os
import re
import shutil
from pathlib import Path

import pytest

PROJECT = Path(__file__).resolve().parents[2]
STRATEGY, PROGRAMS = "strategy", "."
ROOMS = {  # a row a room, from bottom to top
    "base": "",
    "factor": "",
    "network": "",
    "equilibrium": "",
    "equilibrium/dense": STRATEGY,
    "equilibrium/ksp": STRATEGY,
    "equilibrium/quad": STRATEGY,
    "equilibrium/tree": STRATEGY,
    "equilibrium/strategies": "",
    "fracture": "",
    "record": "",
    "ensemble": "",
    "scene": "",
    "compare": "",
    PROGRAMS: "main.cpp compare.cpp merge.cpp",
}
ORDER = list(ROOMS)
NO_CODE = ("CMakeLists.txt", "README.md")
INCLUDE = re.compile(r'^\s*#\s*include\s*(?:<(crackle/[^>]+)>|"([^"]+)"|(\w+))', re.MULTILINE)
DEFINED = re.compile(r"^\s*(?:struct|class|enum class) (\w+)[^;{]*\{", re.MULTILINE)
DECLARED = re.compile(r"^\s*(?:struct|class|enum class) (\w+)(?: : [\w:]+)?;", re.MULTILINE)


def files(project):
    """Every file of the two trees of rooms: its path, and its path in the tree."""
    for tree in (project / "include" / "crackle", project / "src"):
        for path in sorted(path for path in tree.rglob("*") if path.is_file() and path.name not in NO_CODE):
            yield path, path.relative_to(tree)


def room_of(where):
    """Of a file by its path in a tree; None: it lies in no room."""
    room = where.parent.as_posix()
    if room not in ROOMS or (room == PROGRAMS and where.name not in ROOMS[PROGRAMS].split()):
        return None
    return room


def target_of(name, path, project):
    """The path in a tree of what an include names, beside the file that does or in include; None: no such file."""
    for folder, tree in ((path.parent, project / "src"), (project / "include", project / "include" / "crackle")):
        found = Path(os.path.normpath(folder / name))
        if found.is_file() and found.is_relative_to(tree):
            return found.relative_to(tree)
    return None


def complaint(room, other):
    """Why a file of `room` may not include one of `other`; "": it may."""
    if other is None:
        return "is no file of a room"
    if ROOMS[room] == ROOMS[other] == STRATEGY:
        return "" if room == other else "is another strategy's"
    return "" if ORDER.index(other) <= ORDER.index(room) else "runs upwards"


def types_of(project):
    """The rooms whose headers define a type of that name."""
    homes = {}
    for path, where in files(project):
        if path.suffix == ".hpp":
            for name in DEFINED.findall(path.read_text(encoding="utf-8")):
                homes.setdefault(name, set()).add(room_of(where))
    return homes


def arrows(path, project, homes):
    """What a file names of others, and the room that is in: includes, and types that it declares."""
    text = path.read_text(encoding="utf-8")
    for match in INCLUDE.finditer(text):
        name = next(filter(None, match.groups()))
        target = target_of(name, path, project)
        yield name, target and room_of(target)
    for name in DECLARED.findall(text):
        if len(homes.get(name, ())) == 1:
            yield name, *homes[name]


def faults(project):
    """A line for each file that lies in no room, or in another than its header, and for each wrong arrow."""
    found, headers, homes = [], {}, types_of(project)
    for path, where in files(project):
        room, who = room_of(where), path.relative_to(project)
        if room is None:
            found.append(f"{who}: lies in no room of the table")
            continue
        if path.suffix == ".hpp":
            headers.setdefault(path.stem, set()).add(room)
        elif room not in headers.get(path.stem, {room}):
            found.append(f"{who}: its header is in {', '.join(headers[path.stem])}")
        for name, other in arrows(path, project, homes):
            why = complaint(room, other)
            if why:
                found.append(f"{who}: {name} {why}")
    return found


@pytest.fixture(name="rooms", scope="module")
def copy_of_the_rooms(tmp_path_factory):
    """A copy, to plant faults in."""
    copy = tmp_path_factory.mktemp("rooms")
    for tree in ("src", "include"):
        shutil.copytree(PROJECT / tree, copy / tree)
    return copy


@contextlib.contextmanager
def planted(file, text):
    """The text stands at a file's head; the file is made for it where there is none."""
    before = file.read_text(encoding="utf-8") if file.is_file() else None
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_text(f"{text}\n{before or ''}", encoding="utf-8")
    try:
        yield
    finally:
        if before is None:
            file.unlink()
        else:
            file.write_text(before, encoding="utf-8")


def test_no_include_runs_upwards():
    assert len(list(files(PROJECT))) > 150
    found = faults(PROJECT)
    assert not found, "\n".join(found)


def test_every_room_of_the_table_is_there():
    assert {room_of(where) for _, where in files(PROJECT)} == set(ROOMS)


@pytest.mark.parametrize("tree", ["src", "tests/unit"])
def test_every_source_is_on_the_list_of_its_room(tree):
    for folder in {path.parent for path in (PROJECT / tree).rglob("*.cpp")} - {PROJECT / tree}:
        assert folder.relative_to(PROJECT / tree).as_posix() in ROOMS
        listed = re.findall(r"\w+\.cpp", (folder / "CMakeLists.txt").read_text(encoding="utf-8"))
        assert {path.name for path in folder.glob("*.cpp")} == set(listed), folder


@pytest.mark.parametrize("file, text, words", [
    ("src/base/error.cpp", '#include "crackle/network/network.hpp"', "upwards"),
    ("include/crackle/network/network.hpp", '#include "crackle/equilibrium/equilibrium.hpp"', "upwards"),
    ("src/factor/cholmod_factor.cpp", "#  include <crackle/network/lattice.hpp>", "upwards"),
    ("src/equilibrium/held_solver.cpp", '#include "crackle/equilibrium/tree/tree_factor.hpp"', "upwards"),
    ("src/equilibrium/tree/tree_search.cpp", '#include "crackle/equilibrium/ksp/capacitance.hpp"', "another strategy"),
    ("include/crackle/equilibrium/ksp/pc_shell.hpp", '#include "crackle/equilibrium/tree/tree_bonds.hpp"',
     "another strategy"),
    ("src/fracture/fracture.cpp", '\t#include "crackle/record/run_file.hpp"', "upwards"),
    ("src/scene/scene.cpp", '#include "crackle/compare/compare_scene.hpp"', "upwards"),
    ("src/network/network.cpp", '#include "../equilibrium/tree/tree_kernels_body.hpp"', "upwards"),
    ("include/crackle/base/phase.hpp", "namespace crackle {\nclass Equilibrium;\n}", "upwards"),
    ("src/equilibrium/ksp/capacitance.cpp", "struct TreeKernels;", "another strategy"),
    ("src/record/shards.cpp", '#include "crackle/lattice.hpp"', "no file"),
    ("src/record/shards.cpp", '#include "support/temporary_folder.hpp"', "no file"),
    ("src/record/shards.cpp", "#include WHATEVER", "no file"),
    ("src/helpers.cpp", "", "no room"),
    ("include/crackle/helpers.hpp", "", "no room"),
    ("src/statistics/mean.cpp", "", "no room"),
    ("src/equilibrium/tree/kernels/plain.cpp", "", "no room"),
    ("src/network/run_file.cpp", "", "its header is in record"),
], ids=lambda value: re.sub(r"\W+", "_", value).strip("_") or "empty")
def test_what_is_planted_is_found(rooms, file, text, words):
    with planted(rooms / file, text):
        found = faults(rooms)
    assert len(found) == 1 and found[0].startswith(f"{file}: ") and words in found[0]
