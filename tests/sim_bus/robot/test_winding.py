"""Level winding: what drum and carriage add to the cable that is paid out."""

from __future__ import annotations

import math

import numpy as np
import pytest

from cdpr_sim_bus.robot.motor_physics import paid_out
from tests.sim_bus.robot.body_lab import body, run

LOWPASSED_ONCE = {
    "run_out_m": 0.01,
    "pitch_m": 0.01,
    "carriage_error": 1.0,
    "carriage_offset_m": 0.05,
    "carriage_distance_m": 0.2,
}


def test_cable_is_paid_out_as_drum_and_carriage_say() -> None:
    m = body(winding=LOWPASSED_ONCE).motors[0]
    start, _ = paid_out(m)
    for turns in (0.5, 1.0, 3.25):  # of the drum, four of the motor each
        m["angle"] = m["angle_start"] + 8.0 * math.pi * turns
        straight = start + 0.026 * 8.0 * math.pi * turns
        phase = float(m["run_out_phase"])
        eccentric = 0.01 * (math.sin(phase + 2.0 * math.pi * turns) - math.sin(phase))
        askew = math.hypot(0.2, 0.05 + 0.01 * turns) - math.hypot(0.2, 0.05)
        assert paid_out(m)[0] == pytest.approx(straight + eccentric - askew, abs=1e-12)


def test_the_lever_is_the_slope_of_what_is_paid_out() -> None:
    m = body(winding=LOWPASSED_ONCE).motors[1]
    for angle in np.linspace(-30.0, 30.0, 13):
        lengths = []
        for step in (-1e-5, 1e-5):
            m["angle"] = angle + step
            lengths.append(paid_out(m)[0])
        m["angle"] = angle
        assert paid_out(m)[1] == pytest.approx((lengths[1] - lengths[0]) / 2e-5, rel=1e-5)


def test_winding_makes_no_energy() -> None:
    robot = body(winding=LOWPASSED_ONCE)
    robot.platform["velocity"][0, :2] = 0.3, 0.1
    p, m = robot.platform[0], robot.motors

    def energy() -> float:
        total = 0.5 * float(p["mass"] * p["velocity"] @ p["velocity"])
        total += 0.5 * float(p["inertia"][2, 2] * p["spin"][2] ** 2)
        total -= float(p["mass"] * (p["gravity"] @ p["position"]))
        for i in range(robot.n):
            free = paid_out(m[i])[0]
            stretch = max(0.0, robot.distance_m(i) - free)
            total += 0.5 * float(m["rigidity"][i]) / free * stretch**2
        return total + 0.5 * float(np.sum(m["inertia"] * m["velocity"] ** 2))

    begin, worst = energy(), 0.0
    for k in range(400):
        run(robot, 1e-3, begin_s=k * 1e-3)
        worst = max(worst, abs(energy() - begin))
    moved = 0.5 * 4.0 * (0.3**2 + 0.1**2)
    assert worst < 0.05 * moved
    assert np.abs(m["angle"] - m["angle_start"]).max() > 0.5, "the drums have turned"
