"""Compilation is reported, and only when kernels are compiled."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from cdpr_tools.compiling import NOTICE

KERNELS = """
from cdpr_tools.compiling import announce_compiling
from cdpr_profiles.jit import jit

announce_compiling("the test")

@jit
def inner(x, k):
    return x + k

@jit
def outer(x, k):
    return inner(x, 0) + inner(x, -1) + inner(x, k)

print(outer(1.0, 2), len(inner.signatures))
"""


def test_kernels_without_cache_are_compiled_and_reported_once(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The same machine code serves constants and variables."""
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / "kept"))
    script = tmp_path / "kernels.py"
    script.write_text(KERNELS)
    first, again = (
        subprocess.run([sys.executable, str(script)], capture_output=True, text=True, check=True)
        for _ in range(2)
    )
    assert first.stdout.split() == ["4.0", "1"]
    assert first.stderr.startswith(f"{NOTICE} the test once") and first.stderr.count("\n") == 1
    assert again.stdout.split()[0] == "4.0" and again.stderr == ""


TASKS = """
from cdpr_profiles import load_robot
from cdpr_tools.host.kernels import compile_with

def needs(name):
    raise ModuleNotFoundError(name=name)

compile_with("a task", lambda: print(len(load_robot("planar-3").axes)))
compile_with("a task", lambda: needs("fastapi.responses"))
try:
    compile_with("a task", lambda: needs("cdpr_rt.gone"))
except ModuleNotFoundError as error:
    print(error.name)
"""


def test_kernels_are_compiled_with_shipped_robots_and_without_missing_modules(
    tmp_path: Path,
) -> None:
    own = tmp_path / "cdpr-rt" / "profiles" / "robots" / "planar-3.toml"
    own.parent.mkdir(parents=True)
    own.write_text("axes = []\n")
    done = subprocess.run(
        [sys.executable, "-c", TASKS],
        env=os.environ | {"XDG_CONFIG_HOME": str(tmp_path)},
        capture_output=True, text=True, check=True,
    )  # fmt: skip
    assert done.stdout.split() == ["3", "cdpr_rt.gone"]


NOWHERE = """
from cdpr_profiles import user_folders
from pathlib import Path
user_folders.temporary_folder = lambda: Path("/proc/nowhere/own")
from cdpr_profiles.jit import jit
from cdpr_tools.host import kernels

@jit
def kernel(x):
    return x + 1.0

for task in (lambda: None, lambda: kernel(1.0)):
    print(kernels.compile_with("a task", task))
kernels.compile_kernels = lambda processes: kernels.compile_with("a task", lambda: None)
from cdpr_tools.cli import main
main()
"""


def test_doctor_fails_without_a_cache_folder_only_after_compiling_a_kernel(
    tmp_path: Path,
) -> None:
    (script := tmp_path / "kernels.py").write_text(NOWHERE)
    (tmp_path / "__pycache__").touch()  # numba expects a folder here
    given = {"HOME": "/proc/nowhere", "PYTHONDONTWRITEBYTECODE": "1"}
    others = ("NUMBA_CACHE_DIR", "XDG_CACHE_HOME", "CDPR_KERNELS_NOT_KEPT")
    nowhere = {k: v for k, v in os.environ.items() if k not in others} | given
    done = subprocess.run(
        [sys.executable, str(script), "doctor", "--compile"],
        env=nowhere, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert (done.returncode, done.stdout.split()) == (1, ["True", "False"]), done.stderr
    error = done.stderr.splitlines()[-1]
    assert "/proc/nowhere/own are not writable; set NUMBA_CACHE_DIR to a writable folder" in error
