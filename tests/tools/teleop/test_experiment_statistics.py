"""Tables and analysis of variance of synthetic errors with known results."""

from __future__ import annotations

import re

import numpy as np
import pytest

from cdpr_tools.teleop import experiment_tables as tables
from cdpr_tools.teleop.experiment_tables import (
    PLACE,
    SCALE,
    lines,
    rows,
    run_times_s,
    variance_analysis,
)
from cdpr_tools.teleop.experiment_trial import POINT


def made_up(sigma_mm: dict[float, float], runs: int = 30) -> np.ndarray:
    """Return errors whose spread depends only on the scale. A run takes 10 s per target."""
    random = np.random.default_rng(3)
    found = []
    for place in "AB":
        for scale, sigma in sigma_mm.items():
            for repeat in range(runs):
                run = np.zeros(10, POINT)
                run["place"], run["scale"], run["repeat"] = place, scale, repeat
                run["round_trip_s"] = 0.35 if repeat % 2 else 0.73
                run["target"] = np.arange(10)
                run["pressed_s"] = 10.0 * np.arange(1, 11) + repeat % 2
                run["judged_m"] = 1e-3 * random.normal((0.2, -0.1), sigma, (10, 2))
                run["error_m"] = run["judged_m"]
                found.append(run)
    return np.concatenate(found)


POINTS = made_up({2.0: 0.3, 8.0: 0.9})


def row(variable: str, level: str) -> dict:
    return next(r for r in rows(POINTS) if (r["variable"], r["level"]) == (variable, level))


def test_each_level_has_its_mean_and_three_sigma() -> None:
    of_scale = row(SCALE, "8:1")
    assert of_scale["mean_mm"] == pytest.approx([0.2, -0.1], abs=0.12)
    assert of_scale["three_sigma_mm"] == pytest.approx([2.7, 2.7], rel=0.1)
    assert of_scale["targets"] == 600
    assert of_scale["runs"] == 60
    both = np.sqrt((0.3**2 + 0.9**2) / 2.0)
    assert row(PLACE, "A")["three_sigma_mm"] == pytest.approx([3 * both] * 2, rel=0.1)


def test_a_level_is_reached_with_half_the_errors_of_the_thesis() -> None:
    assert row(SCALE, "2:1")["reached"]  # 0.9 mm: at most 1.66 and 1.195
    assert not row(SCALE, "8:1")["reached"]  # 2.7 mm: at most 2.65 and 2.435
    assert row(SCALE, "8:1")["share_of_thesis"][1] == pytest.approx(2.7 / 4.87, rel=0.1)
    assert row(tables.OPERATION, "350 ms")["thesis"]["level"] == "on site"
    assert row(tables.OPERATION, "730 ms")["thesis"]["level"] == "remote"


def test_time_is_that_of_complete_runs() -> None:
    assert sorted(set(run_times_s(POINTS))) == [100.0, 101.0]
    assert row(tables.OPERATION, "350 ms")["time_s"] == pytest.approx(101.0)
    assert row(PLACE, "B")["time_sigma_s"] == pytest.approx(0.5, rel=0.05)


def test_variance_analysis_finds_only_the_variable_that_differs() -> None:
    found = {one["variable"]: one for one in variance_analysis(POINTS)}
    assert found[SCALE]["differs"]
    assert found[SCALE]["degrees_of_freedom"] == [1, 1198]
    assert not found[PLACE]["differs"]
    norms = 1e3 * np.linalg.norm(POINTS["error_m"], axis=1)
    groups = [norms[POINTS["scale"] == scale] for scale in (2.0, 8.0)]
    between = sum(len(g) * (g.mean() - norms.mean()) ** 2 for g in groups)
    within = sum(((g - g.mean()) ** 2).sum() for g in groups) / (len(norms) - 2)
    assert found[SCALE]["F"] == pytest.approx(between / within)
    alone = POINTS[POINTS["scale"] == 2.0]
    assert SCALE not in {one["variable"] for one in variance_analysis(alone)}


def test_the_text_names_the_rows_above_half_of_the_thesis() -> None:
    table = rows(POINTS)
    text = lines(
        {"rows": table, "operator_alone": table, "variance_analysis": variance_analysis(POINTS)}
    )
    assert text[-1].startswith("3 sigma above half")
    assert "scale 8:1" in text[-1] and "scale 2:1" not in text[-1]
    assert len(re.findall("^scale", "\n".join(text), re.MULTILINE)) == 7


def test_pictures_show_each_error_and_the_bars_of_the_thesis(tmp_path) -> None:
    drawn = tables.draw(POINTS, tmp_path)
    assert [path.name for path in drawn] == [
        "figure-2.10.png", "figure-2.11.png", "figure-2.12.png",
    ]  # fmt: skip
    assert all(path.stat().st_size > 10_000 for path in drawn)
    cloud = tables.errors(POINTS, tables.VARIABLES[SCALE]).axes[0]
    assert sum(len(line.get_xdata()) for line in cloud.lines) == len(POINTS)
