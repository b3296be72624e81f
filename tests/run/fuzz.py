#!/usr/bin/env python3
"""Feeds crackle with damaged files, strange networks, options files and command lines, and looks at how it ends.

    CRACKLE=build/release/crackle tests/run/fuzz.py [--seconds 600] [--seed 1] [--family networks ...] [--keep FOLDER]
    CRACKLE=build/sanitize/crackle tests/run/fuzz.py ...       with ASan and UBSan, whatever they say is a fault

However strange the input: exit status 0 or 1; with 1 one line that begins with the program's name; an end within ten
seconds and 4 GiB; inputs untouched, and outputs too unless the run had begun; no number used that the input doesn't have.
Prints each kind of fault with the first case that has it and leaves that case in --keep. Case n of a seed and family is
the same everywhere: --case n makes it again.
"""
import argparse
import functools
import os
import random
import re
import resource
import shutil
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

import conftest  # pylint: disable=unused-import  # makes postprocess importable
import h5py
import numpy as np
from crackle.files import read_run
from damage import GOOD, SECONDS, damaged_uses, in_child, kinds
from fuzz_networks import write_strange_network
from fuzz_options import as_line, strange_command, strange_file
from fuzz_structures import STRUCTURES, change_structure
from networks import small_network
from program import PROGRAMS, contents, execute, options_of, whole_run

GIB = 2**30
MEMORY = 4 * GIB  # of a process
LONGEST_LINE = 1500
BREAK = "crackle -lattice file -lattice_file network.h5 -disorder file -record breaks,network -monitor none -overwrite"
ECHOED = re.compile("^-stop ", re.MULTILINE)  # the options are read, the network is made: a run may begin
ALARMS = ("Sanitizer", "runtime error:", "PETSC ERROR", "HDF5-DIAG", "backtrace", "Assertion", "terminate called")


@dataclass
class Fault:
    kind: str      # what rule is broken, the same for all cases that break it alike
    case: str      # how the case was made
    line: str      # what was run
    said: str


@functools.lru_cache(maxsize=None)
def is_sanitized():
    return b"__asan_init" in Path(PROGRAMS["crackle"]).read_bytes()


def limit_memory():
    if not is_sanitized():  # ASan claims terabytes of addresses
        resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))


def rule_broken_by_the_end(result, program):
    """Of a program that was run: "" or the rule."""
    status, stderr = result.returncode, result.stderr
    alarm = next((word for word in ALARMS if word in stderr), None)
    if alarm:
        return alarm
    if status is None:
        return "no end"
    if status not in (0, 1):
        return f"status {status}"
    if status == 0:
        said = [line for line in stderr.splitlines() if not line.startswith(f"{program}: ")]
        return "status 0 and words on stderr" if said else ""
    if stderr.count("\n") != 1 or not stderr.startswith(f"{program}: "):
        return "not one line" if stderr else "no line"
    if re.search("[\x00-\x1f\x7f-\x9f]", stderr[:-1]) or len(stderr) > LONGEST_LINE:
        return "a line that can't be read"
    return "a line for programmers" if re.search(r"\.[ch]pp|std::|bad_alloc|PETSc error \d", stderr) else ""


def rule_broken_in_files(result, before, after, folder, output):
    """Inputs stay as they are. Outputs, too, unless a run has begun: then a run is there, readable, if without samples."""
    ours = {output, f"{output}.shards"}
    touched = [name for name in before.keys() | after.keys() if before.get(name, ()) != after.get(name, ())]
    inputs = [name for name in touched if name.split("/")[0] not in ours]
    if inputs:
        return f"touched {', '.join(sorted(inputs))}"
    if not touched or result.returncode == 0:
        return ""
    return implausible(folder / output) if ECHOED.search(result.stdout) else "touched the output"


def implausible(path):
    """Whether a run file can't be read, or holds what can't be."""
    verdict, what = in_child(lambda: len(read_run(path)))
    return "" if verdict == "ended" else f"left a run that can't be read: {what}"


def end_of(folder, line, output="run.h5"):
    """Runs a line in a folder: the rule that was broken, or ""; status; what was said."""
    before = contents(folder)
    result = execute(folder, line, prepare=limit_memory, seconds=SECONDS)
    rule = rule_broken_by_the_end(result, line.split()[0]) or rule_broken_in_files(result, before, contents(folder), folder, output)
    return rule, result.returncode, result.stderr


def numbers_used(folder):
    """In a run file's /network, compared with what the network file has: the first that differs, or ""."""
    with h5py.File(folder / "network.h5", "r") as given, h5py.File(folder / "run.h5", "r") as used:
        for name in ("nodes/position", "nodes/grip", "bonds/nodes", "bonds/stiffness", "bonds/threshold"):
            wanted = given["network"].get(name)
            if wanted is None:
                continue
            found = used["network"][name][...]
            with np.errstate(all="ignore"):
                alike = found.shape == wanted.shape or wanted.shape == (1, *found.shape)  # thresholds of one sample
                same = alike and np.array_equal(found.ravel(), wanted[...].astype(found.dtype).ravel())
            if not same:
                return name
    return ""


def examine_network(chance, folder):
    """A strange network, broken. What stands in `run.h5` before is a whole run."""
    (folder / "run.h5").write_bytes(whole_run())
    done = write_strange_network(chance, folder / "network.h5")
    line = BREAK + chance.choice(("", " -equilibrium dense", " -grips clamped", " -break_on tension",
                                  " -ksp_type preonly -pc_type cholesky -pc_factor_mat_solver_type mumps"))
    line += " -output run.h5"
    rule, status, said = end_of(folder, line)
    if not rule and status == 0:
        if any(what.startswith("!") for what in done):
            rule = "used " + next(what for what in done if what.startswith("!")).split(" ", 1)[-1].split(",")[0]
        else:
            verdict, what = in_child(numbers_used, folder)
            rule = f"used other numbers than {what}" if verdict == "ended" and what else ""
            rule = rule or implausible(folder / "run.h5")
    return [Fault(rule, "; ".join(done), line, said)] if rule else []


def examine_options_file(chance, folder):
    data, how = strange_file(chance)
    (folder / "scene.opts").write_bytes(data)
    (folder / "other.opts").write_text("-seed 4\n")
    (folder / "run.h5").write_bytes(whole_run())
    small_network().write(folder / "network.h5")
    os.mkfifo(folder / "pipe")
    line = "crackle -overwrite -lattice_size 2 -monitor none -output run.h5 -options_file scene.opts"
    rule, status, said = end_of(folder, line)
    return [Fault(rule, f"{how}, {len(data)} bytes", line, said)] if rule else []


def examine_words(chance, folder):
    """A command line of any of the programs."""
    small_network().write(folder / "network.h5")
    for name in ("run.h5", "other.h5"):
        (folder / name).write_bytes(whole_run())
    (folder / "tree.opts").write_text("-equilibrium tree\n")
    (folder / "cg.opts").write_text("-ksp_type cg\n-pc_type icc\n")
    os.mkfifo(folder / "pipe")
    words = strange_command(chance)
    given = {name: value for name, value in zip(words, words[1:]) if name.startswith("-")}
    output = os.path.normpath(given.get("-output", {"crackle_compare": "compare.h5"}.get(words[0], "crackle.h5")))
    line = as_line(words)
    rule, status, said = end_of(folder, line, output)
    if not rule and status == 0 and words[0] == "crackle" and (folder / output).is_file():
        rule = implausible(folder / output) or another_option(folder / output, given)
    return [Fault(rule, "words", line, said)] if rule else []


def another_option(path, given):
    """What a run file says of the options it was made with must be what was given."""
    for name, value in options_of(path).items():
        if not given.get(name, "-").startswith("-") and given[name] != value:
            return f"kept {name} with another value"
    return ""


@functools.lru_cache(maxsize=None)
def whole_files():
    """A kind of file by name; kept until the end of the process."""
    whole_files.folder = tempfile.TemporaryDirectory()
    return {kind.name: kind.make(Path(whole_files.folder.name) / kind.name) for kind in kinds()}


def examine_damage(chance, folder):
    kind = whole_files()[chance.choice(("network", "run", "shard", "checkpoint", "comparison"))]
    number = chance.randrange(10**9)
    return [Fault(verdict, f"{kind.name} {number}, {use}: {how}", use, said)
            for use, how, verdict, said in damaged_uses(kind, number, folder) if verdict not in GOOD]


def examine_run(chance, folder):
    """A run, a shard, a checkpoint or a comparison of another structure. Numbers that it has, in another type say, may
    be used; what begins with "!" may not.
    """
    kind = whole_files()[chance.choice(("run", "run", "shard", "checkpoint", "comparison"))]
    changed = folder / Path(kind.file).name
    shutil.copyfile(kind.whole / kind.file, changed)
    with h5py.File(changed, "r+") as file:
        done = change_structure(chance, chance.choice(STRUCTURES), file, folder)
    return [Fault(verdict, f"{kind.name}, {use.name}: {done}", use.line or use.name, said) for use in kind.uses
            for verdict, said in [kind.use(use, changed, folder / "used")]
            if verdict not in (GOOD if done.startswith("!") else (*GOOD, "silent"))]


FAMILIES = {"damage": examine_damage, "runs": examine_run, "networks": examine_network, "options": examine_options_file,
            "words": examine_words}


def examine(family, seed, number, folder):
    """The faults of one case, made in an empty folder."""
    folder.mkdir()
    return FAMILIES[family](random.Random(f"{family} {seed} {number}"), folder)


def signature(fault):
    """The same for faults alike: the rule, and what was said without its numbers and names."""
    return fault.kind, re.sub(r"\d[\d.e+-]*", "N", fault.said.strip()[:60])


def search(arguments):
    """Case after case until the time is over. The number of kinds of faults."""
    found, cases, end = {}, 0, time.monotonic() + arguments.seconds
    numbers = [arguments.case] if arguments.case is not None else range(10**9)
    with tempfile.TemporaryDirectory() as temporary:
        for number in numbers:
            for family in arguments.family:
                folder = Path(temporary) / family
                faults = examine(family, arguments.seed, number, folder)
                cases += 1
                for fault in faults:
                    tell(found, fault, family, number, arguments, folder)
                shutil.rmtree(folder)
            if time.monotonic() > end:
                break
    print(f"{cases} cases, {sum(found.values())} faults of {len(found)} kinds")
    return len(found)


def tell(found, fault, family, number, arguments, folder):
    new = signature(fault) not in found
    found[signature(fault)] = found.get(signature(fault), 0) + 1
    if not new:
        return
    print(f"{family}, seed {arguments.seed}, case {number}: {fault.kind}\n    {fault.case}\n    {fault.line[:300]}\n"
          f"    {fault.said.strip()[:600]}", flush=True)
    if arguments.keep:
        kept = Path(arguments.keep) / f"{family}_{arguments.seed}_{number}"
        shutil.rmtree(kept, ignore_errors=True)
        kept.parent.mkdir(parents=True, exist_ok=True)
        subprocess.run(["cp", "-a", folder, kept], check=True)  # shutil would read pipes
        (kept / "line.txt").write_text(fault.line + "\n")


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seconds", type=float, default=60)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--family", nargs="+", choices=FAMILIES, default=list(FAMILIES))
    parser.add_argument("--case", type=int, help="this one alone")
    parser.add_argument("--keep", help="a folder for the first case of every kind of fault")
    os.environ.setdefault("OMP_NUM_THREADS", "1")  # OpenBLAS claims memory for every thread it may start
    os.environ.setdefault("ASAN_OPTIONS", "detect_leaks=0")  # MPI's and hwloc's
    return 1 if search(parser.parse_args()) else 0


if __name__ == "__main__":
    sys.exit(main())
