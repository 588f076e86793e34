"""Findings about robots whose tensions destabilise or stabilise the platform's orientation."""

from __future__ import annotations

import dataclasses
import math
import re

import numpy as np
import pytest

from cdpr_profiles import Robot, load_robot
from cdpr_rt.diagnosis.loop_checks import loop_findings
from cdpr_rt.diagnosis.subject import Subject
from cdpr_rt.model.platform_model import platform_model
from cdpr_rt.platform.loop_design import SwingsError, designed_loop
from tests.cdpr_rt.diagnosis.robots import with_cables
from tests.cdpr_rt.platform.platform_physics import Machine, crossed_rod, short_arms


def findings_with_bounds(
    machine: Machine,
    low_N: float,
    high_N: float,
    period_s: float = 1e-3,
    *,
    impossible: bool = True,
) -> list[str]:
    """Return the findings about a robot with these bounds of tension."""
    base = load_robot("spatial-8")
    bounds = {"tension_min_N": (low_N,), "tension_max_N": (high_N,), "slack_N": (0.5 * low_N,)}
    robot: Robot = dataclasses.replace(
        base,
        platform=machine.platform,
        axes=list(machine.axes),
        limits=base.limits.model_copy(update=bounds),
        sync_period_s=period_s,
    )
    found = list(loop_findings(Subject(robot)))
    return [f"{f.key}: {f.text}" for f in found if f.impossible is impossible]


def test_a_platform_destabilised_faster_than_a_loop_can_hold_is_rejected() -> None:
    (text,) = findings_with_bounds(crossed_rod(), 200.0, 800.0)
    assert text.startswith("axes[0].anchor_point_m: its tensions turn the platform away")
    assert findings_with_bounds(crossed_rod(), 20.0, 150.0) == []


def test_designed_loops_are_cached_separately_for_each_bounds_of_tension() -> None:
    arms = short_arms()
    n = len(arms.axes)
    bounds = [(np.full(n, low), np.full(n, low + 80.0)) for low in (5.0, 90.0)]
    weak = (*bounds[0], np.full(n, 40.0))  # bounds by the motors' torque
    loops = [
        designed_loop(platform_model(arms.platform, *both), arms.axes, 1e-3)
        for both in (*bounds, weak)
    ]
    assert loops[0].margins != loops[1].margins
    assert loops[0] is not loops[2]


def test_a_platform_stabilised_by_tensions_is_accepted() -> None:
    assert findings_with_bounds(short_arms(), 200.0, 800.0) == []


def test_a_stable_but_weakly_damped_pose_is_doubtful() -> None:
    late, leans = findings_with_bounds(short_arms(), 20.0, 200.0, 4e-3, impossible=False)
    found = re.match(
        r"axes\[0\]\.anchor_point_m: its tensions act like springs, .* at \(.*\) m "
        r"it may swing at (\d+) Hz, "
        r"with (0\.\d+) % of critical damping, for ([\d.]+) s ",
        late,
    )
    assert found is not None, late
    frequency_Hz, damping, lasts_s = map(float, found.groups())
    assert lasts_s > 5.0
    # decay to 2 %; the damping has one digit
    assert lasts_s * frequency_Hz * damping == pytest.approx(100 * math.log(50) / math.tau, rel=0.2)
    assert re.search(
        r"^sync_period_s: value 0\.004; the loop relies on the assumed damping .*damping_s "
        r".*: with 0\.5 ms a mode at [34]\d Hz grows with the platform at \(.*\) m; ",
        leans,
    )
    (leans,) = findings_with_bounds(short_arms(), 20.0, 200.0, 2e-3, impossible=False)
    assert leans.startswith("sync_period_s: value 0.002; the loop relies on")
    assert findings_with_bounds(short_arms(), 20.0, 200.0, 1e-3, impossible=False) == []
    assert (
        findings_with_bounds(
            with_cables(short_arms(), damping_s=2e-3), 20.0, 200.0, 2e-3, impossible=False
        )
        == []
    )


def test_a_weakly_damped_platform_on_soft_cables_is_doubtful() -> None:
    """Its tensions follow its pose, unlike tensions that stabilise a platform."""
    robot = load_robot("suspended-8")
    assert list(loop_findings(Subject(robot))) == []
    softer = 3.0 * robot.axes[0].winch.cable.elongation_percent_per_N
    robot = with_cables(robot, elongation_percent_per_N=softer)
    (found,) = loop_findings(Subject(robot))
    assert (found.key, found.impossible) == ("platform.mass_kg", False)
    lasts = re.search(r"swing at ([\d.]+) Hz, with (\d) % of .* for ([\d.]+) s ", found.text)
    assert lasts is not None, found.text
    frequency_Hz, percent, lasts_s = map(float, lasts.groups())
    assert lasts_s > 5.0
    assert lasts_s * frequency_Hz * percent == pytest.approx(100 * math.log(50) / math.tau, rel=0.2)


def test_a_robot_that_each_loop_destabilises_is_rejected_by_its_cycle(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def refuse(*_: object) -> None:
        raise SwingsError("the loop drives a mode")

    monkeypatch.setattr("cdpr_rt.diagnosis.subject.designed_loop", refuse)
    (text,) = findings_with_bounds(short_arms(), 20.0, 200.0, 4e-3)
    assert text.startswith("sync_period_s: value 0.004; the loop drives a mode: a shorter cycle")
