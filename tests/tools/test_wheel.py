"""The wheel runs beside folders with the names of the repository's packages."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

pytestmark = pytest.mark.long

REPOSITORY = Path(__file__).parents[2]
FOLDERS = ("cdpr_rt", "drivers", "profiles", "sim_bus", "src", "tools")
PIP = (sys.executable, "-m", "pip", "--disable-pip-version-check", "-q")


def installed(scratch: Path) -> Path:
    """Return a folder with exactly the files that a wheel of this repository installs."""
    source, wheels, target = (scratch / name for name in ("source", "wheels", "installed"))
    source.mkdir()
    for name in FOLDERS:
        ignored = shutil.ignore_patterns("__pycache__", "*.egg-info")
        shutil.copytree(REPOSITORY / name, source / name, symlinks=True, ignore=ignored)
    for name in ("pyproject.toml", "README.md", "LICENSE"):
        shutil.copy(REPOSITORY / name, source)
    alone = ("--no-deps", "--no-index")
    for words in (
        ("wheel", *alone, "--no-build-isolation", "-w", str(wheels), str(source)),
        ("install", *alone, "--find-links", str(wheels), "--target", str(target), "cdpr-rt"),
    ):
        subprocess.run([*PIP, *words], check=True, timeout=300)
    return target


def test_a_wheel_runs_beside_folders_of_the_same_names(tmp_path: Path) -> None:
    """It starts a simulator process and uses the shipped profiles."""
    target, beside = installed(tmp_path), tmp_path / "beside"
    for name in FOLDERS:
        (beside / name).mkdir(parents=True)
        (beside / name / "__init__.py").write_text("raise SystemExit('imported by mistake')\n")
    names = {path.name for path in target.iterdir() if path.suffix != ".dist-info"}
    assert names == {
        "bin",
        *(path.name for path in (REPOSITORY / "src").iterdir() if path.is_symlink()),
    }

    templates = target / "cdpr_tools" / "templates"
    assert {path.name for path in templates.iterdir()} == {
        path.name for path in (REPOSITORY / "tools" / "templates").iterdir()
    }

    def run(*words: str) -> str:
        done = subprocess.run(
            [str(target / "bin" / "cdpr"), *words],
            cwd=beside,
            env={**os.environ, "PYTHONPATH": str(target), "CDPR_TEST_FORKS": "0"},
            capture_output=True,
            text=True,
            timeout=400,
            check=False,
        )
        assert done.returncode == 0, done.stderr[-2000:]
        return done.stdout

    assert "spatial-8" in run("profiles", "list")
    told = run("drive", "enable", "winch-mpp0923d", "--bus", "simbus:", "--yes", "--json")
    assert json.loads(told.splitlines()[-1])
