"""`cdpr bench calibration` solves the same by both ways; times belong to a machine."""

from __future__ import annotations

from typer.testing import CliRunner

from cdpr_tools.bench import calibration as bench
from cdpr_tools.commands.bench import app


def test_both_ways_are_told() -> None:
    done = CliRunner().invoke(app, ["calibration", "--poses", "12", "--repeats", "2"])
    assert done.exit_code == 0, done.output
    assert "poses unknown" in done.output and "SciPy takes" in done.output


def test_plain_scipy_finds_what_was_made_up() -> None:
    file, true, seen = bench._made_up(20)
    known = bench._plain(file, seen)
    before = bench._off_mm(file, true)
    assert bench._off_mm(file.with_values(known[: file.size]), true) < 4.0 * before
