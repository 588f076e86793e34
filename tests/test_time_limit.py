"""A test that hangs ends with a traceback, and its processes end with it."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
TESTS = """
import pathlib
import subprocess

import pytest


@pytest.fixture
def process():
    process = subprocess.Popen(["sleep", "600"], stdout=subprocess.DEVNULL)
    pathlib.Path(__file__).with_name("pid").write_text(str(process.pid))
    yield process
    process.kill()
    process.wait()


@pytest.fixture
def waits_at_its_end(process):
    yield
    process.wait()  # for ever


def test_hangs(process):
    process.wait()


def test_fails_and_then_hangs(waits_at_its_end):
    assert False, "this one fails"
"""


@pytest.mark.parametrize(
    ("name", "line"),
    [("test_hangs", "def test_hangs"), ("test_fails_and_then_hangs", "def waits_at_its_end")],
)
def test_a_hanging_test_ends_with_a_traceback_and_leaves_no_process(
    tmp_path: Path, name: str, line: str
) -> None:
    file = tmp_path / "test_endless.py"
    file.write_text(TESTS)
    options = ["-c", ROOT / "pyproject.toml", "-o", "timeout=3", "-p", "no:cacheprovider"]
    run = subprocess.run(
        [sys.executable, "-m", "pytest", "-p", "conftest", *options, f"{file}::{name}"],
        env={**os.environ, "PYTHONPATH": str(ROOT / "tests")},
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )
    assert run.returncode == 1, run.stdout + run.stderr
    assert "Timeout (>3.0s) from pytest-timeout" in run.stdout
    assert line in run.stdout
    assert "process.wait()" in run.stdout
    with pytest.raises(ProcessLookupError):
        os.kill(int((tmp_path / "pid").read_text()), 0)


def test_each_test_has_a_time_limit(request: pytest.FixtureRequest) -> None:
    assert float(request.config.getini("timeout")) > 0.0
