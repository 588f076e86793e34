"""Winches can tighten the cables of a platform on its stand and keep heavy cables wound."""

from __future__ import annotations

import dataclasses
import re
from pathlib import Path

import numpy as np
import pytest

from cdpr_profiles import Robot, load_robot
from cdpr_rt.diagnosis.checks import stand_findings, standing_tensions_N, unwinding
from cdpr_rt.diagnosis.subject import Finding, Subject
from cdpr_rt.model.statics import statics_of

SHIPPED = ("planar-3", "planar-4", "point-4", "spatial-8", "suspended-6", "suspended-8")


def tightening_findings(name: str, high_N: float | None = None) -> list[Finding]:
    """Return the findings about a shipped robot, with tensions of 2 N to `high_N` if given."""
    robot = load_robot(name)
    if high_N is not None:
        bounds = {"tension_min_N": (2.0,), "tension_max_N": (high_N,), "slack_N": (0.5,)}
        robot = dataclasses.replace(robot, limits=robot.limits.model_copy(update=bounds))
    return list(stand_findings(Subject(robot)))


@pytest.mark.parametrize("name", SHIPPED)
def test_shipped_robots_can_be_tightened(name: str) -> None:
    assert tightening_findings(name) == []


@pytest.mark.parametrize(("name", "high_N"), [("planar-3", 12.0), ("spatial-8", 25.0)])
def test_tension_bounds_below_friction_are_reported_with_sufficient_ones(
    name: str, high_N: float
) -> None:
    (finding,) = tightening_findings(name, high_N)
    assert (finding.key, finding.impossible) == ("limits.tension_max_N", False)
    assert "the friction of such winches is usually up to 7.6 N" in finding.text
    enough = re.search(r"use (\d+) or more,", finding.text)
    assert enough is not None
    assert tightening_findings(name, float(enough[1])) == []


def heavy(weight_N_m: float) -> Robot:
    """Return suspended-8 with heavy cables: exit points are 3.9 to 4.9 m above anchors at home."""
    robot = load_robot("suspended-8")
    assert robot.platform is not None
    platform = dataclasses.replace(robot.platform, cable_weights_N_m=(weight_N_m,) * 8)
    return dataclasses.replace(robot, platform=platform)


def test_ropes_that_unwind_without_power_are_reported_unless_brakes_hold_them(
    tmp_path: Path,
) -> None:
    winch = load_robot("suspended-8").axes[0].winch
    rubs_N = 0.02 * winch.motor.rated_torque_Nm / winch.cable_m_per_motor_rad
    for hangs_N, unwinds in ((0.95 * rubs_N, False), (1.05 * rubs_N, True)):
        robot = heavy(
            hangs_N / 4.91
        )  # height of the highest exit point above the lowest anchor point
        found = list(unwinding(Subject(robot)))
        assert bool(found) is unwinds
    robot = heavy(1.5 * rubs_N / 3.9)
    (finding,) = unwinding(Subject(robot))
    assert finding.key.endswith(".winch") and not finding.impossible
    assert all(axis.name in finding.text for axis in robot.axes)
    shipped = (robot.path.parents[1] / "safety_io" / "modbus-remote-io.toml").read_text()
    before, after = shipped.split("[[axes]]", 1)
    braked = "".join(
        f'[[axes]]\naxis = "{k}"\nnode_id = {k}\n'
        f"brake = {{ output = {{ coil = {10 + k} }}, feedback = {{ input = {10 + k} }} }}\n"
        for k in range(2, 9)
    )
    io = tmp_path / "io.toml"
    io.write_text(f"{before}{braked}\n[[axes]]{after}")
    held = dataclasses.replace(robot, safety_io=str(io))
    assert not list(unwinding(Subject(held)))
    io.write_text(shipped)  # brakes hold only the first axis
    (finding,) = unwinding(Subject(held))
    assert "axis 1," not in finding.text and "axis 2, " in finding.text


def test_standing_torque_includes_the_weight_of_hanging_cables() -> None:
    light, robot = load_robot("suspended-8"), heavy(2.0)
    place_m, platform = np.array([0.0, 0.0, 1.0]), robot.platform
    assert platform is not None
    points = zip(platform.exit_points_m, platform.anchor_points_m, strict=True)
    statics = statics_of(robot)
    np.testing.assert_allclose(
        statics.rises_N(place_m),
        [exit_m[2] - 1.0 - anchor_m[2] for exit_m, anchor_m in points],
        rtol=1e-12,
    )
    more_N = standing_tensions_N(statics) - standing_tensions_N(statics_of(light))
    assert (more_N > 1.0).all()
