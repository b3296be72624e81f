"""What stands in a README: its blocks of code, run as they stand there, and its links."""
import os
import re
import subprocess
import sys
from pathlib import Path

from program import PROGRAMS, environment

PROJECT = Path(__file__).resolve().parents[2]


def blocks(readme, kind):
    return re.findall(rf"^```{kind}\n(.*?)^```$", readme.read_text(encoding="utf-8"), re.M | re.S)


def make_project(folder):
    """Makes the folder look like the project's, built."""
    (folder / "build" / "release").mkdir(parents=True)
    for place, there in (("build/release/crackle", PROGRAMS["crackle"]),
                         ("build/release/crackle_compare", PROGRAMS["crackle_compare"]),
                         ("postprocess", PROJECT / "postprocess"), ("options", PROJECT / "options")):
        (folder / place).symlink_to(there)
    return folder


def run_block(folder, command, text):
    """Runs a block by a command that reads it, with this python3 first on PATH."""
    (folder / "bin").mkdir(exist_ok=True)
    (folder / "bin" / "python3").write_text(f'#!/bin/sh\nexec {sys.executable} "$@"\n')
    (folder / "bin" / "python3").chmod(0o755)
    path = os.pathsep.join([str(folder / "bin"), os.environ["PATH"]])
    variables = {**environment(), "PATH": path, "MPLCONFIGDIR": str(folder / "matplotlib")}
    return subprocess.run(command, cwd=folder, env=variables, input=text, capture_output=True, text=True, timeout=200,
                          check=False)


def anchors(text):
    """What a page makes of headings, to be linked to."""
    headings = re.findall(r"^#+ (.*)$", re.sub(r"^```.*?^```$", "", text, flags=re.M | re.S), re.M)
    return {re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in headings}


def dead_links(readme):
    """Links and pictures that lead to no file, or to no heading of it; those to other places aside."""
    found = []
    for link in re.findall(r"\]\(([^)\s]+)\)", readme.read_text(encoding="utf-8")):
        if "://" in link:
            continue
        name, _, anchor = link.partition("#")
        target = readme.parent / name if name else readme
        if not target.exists() or (anchor and anchor not in anchors(target.read_text(encoding="utf-8"))):
            found.append(link)
    return found
