"""Runs crackle as a user does, and looks at what it leaves. The program's path: environment variable CRACKLE.

Command lines are written as in a shell: run(folder, "-lattice_size 4 -model fuse").
"""
import functools
import os
import shlex
import signal
import subprocess
import tempfile
import time
from pathlib import Path

import h5py
import numpy as np


def program_path(variable, otherwise):
    """A path, from the folder that the tests are started in; they run the program in others. A bare name is PATH's."""
    path = os.environ.get(variable, otherwise)
    return os.path.abspath(path) if os.sep in path else path


CRACKLE = program_path("CRACKLE", "crackle")
OUTPUT = "crackle.h5"  # the default of -output
LONGEST = 120          # seconds
PROGRAMS = {"crackle": CRACKLE, "crackle_merge": str(Path(CRACKLE).with_name("crackle_merge")),
            "crackle_compare": program_path("CRACKLE_COMPARE", str(Path(CRACKLE).with_name("crackle_compare")))}


def environment():
    """The tests', without options that PETSc would take from it."""
    found = {name: value for name, value in os.environ.items() if name != "PETSC_OPTIONS"}
    # as root Open MPI starts only when told that it may
    return {**found, "OMPI_ALLOW_RUN_AS_ROOT": "1", "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1"}


def command(line, ranks=0):
    """The words of a command; ranks > 0: under mpirun."""
    launcher = ["mpirun", "--oversubscribe", "-n", str(ranks)] if ranks else []
    return [*launcher, CRACKLE, *shlex.split(line)]


def start(folder, line, ranks=0):
    """A run in `folder` that goes on by itself."""
    return subprocess.Popen(command(line, ranks), cwd=folder, env=environment(), text=True,
                            stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.PIPE)


def run(folder, line, ranks=0, prepare=None):
    """A run in `folder` to its end, good or bad: returncode, stdout, stderr. prepare: called in its process."""
    return subprocess.run(command(line, ranks), cwd=folder, env=environment(), preexec_fn=prepare,
                          stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.PIPE,
                          timeout=LONGEST, encoding="utf-8", errors="replace", check=False)


def execute(folder, line, ranks=0, prepare=None, seconds=LONGEST, out=subprocess.PIPE):
    """The same of any program, which the line names: "crackle_merge a.h5 -output b.h5". returncode None: it had to be
    killed after so many seconds. out: where its standard output goes.
    """
    program, *words = shlex.split(line)
    launcher = ["mpirun", "--oversubscribe", "-n", str(ranks)] if ranks else []
    process = subprocess.Popen([*launcher, PROGRAMS[program], *words], cwd=folder, env=environment(), preexec_fn=prepare,
                               stdin=subprocess.DEVNULL, stdout=out, stderr=subprocess.PIPE,
                               encoding="utf-8", errors="replace")
    try:
        out, err = process.communicate(timeout=seconds)
        return subprocess.CompletedProcess(process.args, process.returncode, out, err)
    except subprocess.TimeoutExpired:
        kill(process)
        return subprocess.CompletedProcess(process.args, None, "", "")


def succeed(folder, line, ranks=0):
    """A run in `folder` that must come to a good end."""
    result = run(folder, line, ranks)
    assert result.returncode == 0, f"crackle {line}: {result.stderr}"
    return result


def break_samples(folder, line, output=OUTPUT, ranks=0):
    """A run that must come to a good end: all datasets of its file."""
    succeed(folder, f"{line} -monitor none -output {output}", ranks)
    return datasets(folder / output)


def pause_until_samples_are_due(process):
    """From its first samples on the run stops for longer than finished ones wait to be written: the next one is."""
    assert any(line.startswith("-stop ") for line in process.stdout), process.communicate()[1]
    process.send_signal(signal.SIGSTOP)
    time.sleep(2.1)
    process.send_signal(signal.SIGCONT)


def wait_for(condition, process):
    while not condition():
        assert process.poll() is None, f"the run ended too early: {process.communicate()[1]}"
        time.sleep(0.005)


def processes_below(pid):
    """A process and all that it has started."""
    found = [pid]
    for children in Path(f"/proc/{pid}/task").glob("*/children"):
        for child in children.read_text().split():
            found += processes_below(int(child))
    return found


def kill(process):
    """kill -9, of a run and everything that mpirun has started for it, at the same time."""
    for pid in processes_below(process.pid):
        try:
            os.kill(pid, signal.SIGKILL)
        except ProcessLookupError:
            pass
    process.communicate()


def datasets(path):
    """Every dataset of a file, by its full name."""
    found = {}

    def keep(name, item):
        if isinstance(item, h5py.Dataset):
            found["/" + name] = item[...]

    with h5py.File(path, "r") as file:
        file.visititems(keep)
    return found


def attributes(path, group="/"):
    with h5py.File(path, "r") as file:
        return dict(file[group].attrs)


def options_of(path):
    """The options that a run file lists: "-name" to value."""
    text = attributes(path)["options"]
    text = text.decode() if isinstance(text, bytes) else text
    return dict((line.split(" ", 1) + [""])[:2] for line in text.splitlines())


def assert_same(found, expected, but=("/samples/wall_time",)):
    """The same datasets, bit for bit, the time they took aside."""
    assert found.keys() == expected.keys()
    for name in found.keys() - set(but):
        assert found[name].dtype == expected[name].dtype, name
        assert found[name].shape == expected[name].shape, name
        assert found[name].tobytes() == expected[name].tobytes(), name


def assert_same_breaks(found, expected, tolerance=1e-11):
    """The same bonds in the same order. Of loads and stiffnesses, relative errors up to tolerance F_1 / F_k:
    conditioning grows as the stiffness F_k falls.
    """
    np.testing.assert_array_equal(found["/breaks/bond"], expected["/breaks/bond"])
    stiffness = expected["/breaks/stiffness"]
    for name in ("/breaks/load", "/breaks/stiffness"):
        error = np.abs(found[name] - expected[name])
        allowed = tolerance * stiffness[0] / stiffness * np.abs(expected[name])
        assert (error <= allowed).all(), f"{name}: {np.max(error / allowed):.3g} times what is allowed"


def assert_same_while_told(found, expected, tolerance=1e-11):
    """Like assert_same_breaks, with what a dense solve in double expects, which can't tell F from 0 below 1e-8 of F_1: what
    comes after must lie there.
    """
    n = len(expected["/breaks/bond"])
    assert (found["/breaks/stiffness"][n:] < 1e-8 * expected["/breaks/stiffness"][0]).all()
    assert_same_breaks({name: found[name][:n] for name in found.keys() if name.startswith("/breaks/")}, expected, tolerance)


def contents(folder):
    """Every file below a folder with its bytes; folders, pipes and the like with None."""
    return {str(path.relative_to(folder)): path.read_bytes() if path.is_file() else None
            for path in sorted(folder.rglob("*"))}


@functools.lru_cache(maxsize=None)
def whole_run():
    """The bytes of a run file."""
    with tempfile.TemporaryDirectory() as folder:
        succeed(folder, "-lattice_size 1 -monitor none")
        return (Path(folder) / OUTPUT).read_bytes()


def refuse(folder, line, *words, output=OUTPUT):
    """The command line must be refused for a reason that the user can mend, and every file stay as it is.

    One line on stderr, which has all `words` (option or file, value, what is allowed); exit status 1. A whole
    run stands in `output`, and the command line may replace it. output=None: the line says it all.
    """
    if output is not None:
        (folder / output).write_bytes(whole_run())
        line = f"{line} -overwrite -output {output}"
    before = contents(folder)
    result = run(folder, line)
    assert contents(folder) == before, "files were touched"
    assert result.returncode == 1, result.stderr
    assert result.stderr.count("\n") == 1 and result.stderr.startswith("crackle: "), result.stderr
    assert "::" not in result.stderr, f"names of the source are no help: {result.stderr}"
    missing = [word for word in words if word not in result.stderr]
    assert not missing, f"{missing} not in: {result.stderr}"
    return result.stderr
