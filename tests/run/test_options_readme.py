#!/usr/bin/env python3
"""options/README.md: its tables of options are what the programs' -help says, row by row.

    CRACKLE=build/release/crackle tests/run/test_options_readme.py

puts them there.
"""
import functools
import re
import subprocess
import tempfile
from pathlib import Path

import pytest
from program import PROGRAMS, environment

README = Path(__file__).resolve().parents[2] / "options" / "README.md"
COLUMNS = ("option", "default", "meaning", "allowed")
OPTION = re.compile(r"  (-\w+) +\((.*?)\) (.*); ([^;]+)")


def parse_help(text):
    """The rows of a program's own options, of PETSc's none: (name, default, meaning, allowed)."""
    own = text.split("\n\n")[1].splitlines()[1:]
    return [OPTION.fullmatch(line).groups() for line in own]


@functools.lru_cache(maxsize=None)
def ask_help(program):
    with tempfile.TemporaryDirectory() as folder:
        result = subprocess.run([PROGRAMS[program], "-help"], cwd=folder, env=environment(), capture_output=True,
                                text=True, timeout=60, check=True)
    return parse_help(result.stdout)


def options_of(program):
    """Of crackle all, of crackle_compare those that crackle hasn't; in the order of -help."""
    known = [] if program == "crackle" else [row[0] for row in ask_help("crackle")]
    return [row for row in ask_help(program) if row[0] not in known]


def format_row(row):
    name, default, meaning, allowed = (cell.replace("|", r"\|") for cell in row)
    return f"| `{name}` | {f'`{default}`' if default else ''} | {meaning} | {allowed} |"


def format_table(rows):
    return "\n".join([f"| {' | '.join(COLUMNS)} |", "| --- " * len(COLUMNS) + "|", *map(format_row, rows)])


def table_under(heading, text):
    """The first table of options after a heading: where its rows begin and end."""
    head = format_table([]) + "\n"
    begin = text.index(head, text.index(f"\n{heading}\n")) + len(head)
    return begin, text.index("\n\n", begin)


def rows_under(heading, text):
    begin, end = table_under(heading, text)
    return text[begin:end].splitlines()


@pytest.mark.parametrize("program", ["crackle", "crackle_compare"])
def test_table_is_the_programs(program):
    rows = rows_under(f"## Options of `{program}`", README.read_text(encoding="utf-8"))
    assert rows == [format_row(row) for row in options_of(program)]


def test_help_is_read_whole():
    """Meanings with brackets and semicolons, defaults that are empty, options longer than their column."""
    text = ("crackle breaks.\n\nOptions of crackle (default) meaning; allowed values\n"
            "  -disorder              (uniform) law (uniform: t = r; power: t = r^D); uniform or power\n"
            "  -record_profile_height () height of a section (a row); a number above 0\n"
            "  -ensemble_ranks_per_sample (1) processes; an integer from 1\n\nPETSc's own follow.\n\n  -x (1) y; z\n")
    assert parse_help(text) == [
        ("-disorder", "uniform", "law (uniform: t = r; power: t = r^D)", "uniform or power"),
        ("-record_profile_height", "", "height of a section (a row)", "a number above 0"),
        ("-ensemble_ranks_per_sample", "1", "processes", "an integer from 1")]


def test_wrong_rows_are_seen():
    """A row that is missing, one too many and one that says something else each make the tables differ."""
    rows = [format_row(row) for row in options_of("crackle")]
    text = "\n## Options of `crackle`\n\n" + format_table(options_of("crackle")) + "\n\n## More\n"
    assert rows_under("## Options of `crackle`", text) == rows
    for there, instead in ((rows[3] + "\n", ""), (rows[3], rows[3] + "\n" + rows[3]), ("| `16` |", "| `17` |")):
        assert there in text
        assert rows_under("## Options of `crackle`", text.replace(there, instead)) != rows


def main():
    text = README.read_text(encoding="utf-8")
    for program in ("crackle", "crackle_compare"):
        begin, end = table_under(f"## Options of `{program}`", text)
        text = text[:begin] + "\n".join(map(format_row, options_of(program))) + text[end:]
    README.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
