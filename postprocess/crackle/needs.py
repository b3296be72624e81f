"""Whether the python3 that runs a script has the modules that it needs; knows the standard library alone.

    need("h5py", "numpy")
    from crackle.files import read_run
"""
import importlib
import os
import subprocess
import sys

PATIENCE = 60  # seconds that another python3 may take to import everything


def need(*modules):
    """Ends the program, status 1, unless this python3 has the modules: one line says which it lacks, and which
    python3 on PATH has them.
    """
    lacking = [module for module in modules if not can_import(module)]
    if not lacking:
        return
    other = next((python for python in pythons_on_path() if _has(python, modules)), None)
    them = "it" if len(lacking) == 1 else "them"
    advice = f"{other} has {them}" if other else \
        f"no python3 on PATH has {them}; Debian's packages: {' '.join(f'python3-{module}' for module in lacking)}"
    raise SystemExit(f"{os.path.basename(sys.argv[0])}: {sys.executable} lacks {', '.join(lacking)}; {advice}")


def can_import(module):
    try:
        importlib.import_module(module)
    except Exception:  # pylint: disable=broad-except  # built for another numpy, say, it may raise anything
        return False
    return True


def pythons_on_path():
    """Every python3 of PATH, in order."""
    candidates = (os.path.join(folder, "python3") for folder in os.get_exec_path())
    return [path for path in candidates if os.path.isfile(path) and os.access(path, os.X_OK)]


def _has(python, modules):
    try:
        done = subprocess.run([python, "-c", f"import {', '.join(modules)}"], capture_output=True, timeout=PATIENCE,
                              check=False)
    except (OSError, subprocess.TimeoutExpired):
        return False
    return done.returncode == 0
