"""Level winding, creep, gear elasticity and weight of cables."""

from __future__ import annotations

import math

import numpy as np
import pytest
from body_lab import body, free_length_m, run

from cdpr_sim_bus.robot.cable_robot import CableRobot
from cdpr_sim_bus.robot.motor import paid_out
from tests.heavy_cables import standing

LOWPASSED_ONCE = {
    "run_out_m": 0.01,
    "pitch_m": 0.01,
    "carriage_error": 1.0,
    "carriage_offset_m": 0.05,
    "carriage_distance_m": 0.2,
}


def test_length_paid_out_follows_drum_run_out_and_carriage() -> None:
    m = body(winding=LOWPASSED_ONCE).motors[0]
    start, _ = paid_out(m)
    for turns in (0.5, 1.0, 3.25):  # turns of the drum, each with four turns of the motor
        m["angle"] = m["angle_start"] + 8.0 * math.pi * turns
        straight = start + 0.026 * 8.0 * math.pi * turns
        phase = float(m["run_out_phase"])
        eccentric = 0.01 * (math.sin(phase + 2.0 * math.pi * turns) - math.sin(phase))
        askew = math.hypot(0.2, 0.05 + 0.01 * turns) - math.hypot(0.2, 0.05)
        assert paid_out(m)[0] == pytest.approx(straight + eccentric - askew, abs=1e-12)


def test_the_lever_is_the_derivative_of_the_length_paid_out() -> None:
    m = body(winding=LOWPASSED_ONCE).motors[1]
    for angle in np.linspace(-30.0, 30.0, 13):
        lengths = []
        for step in (-1e-5, 1e-5):
            m["angle"] = angle + step
            lengths.append(paid_out(m)[0])
        m["angle"] = angle
        assert paid_out(m)[1] == pytest.approx((lengths[1] - lengths[0]) / 2e-5, rel=1e-5)


def test_winding_creates_no_energy() -> None:
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


# Creep of cables, and elasticity of gear and belt.

LOAD_N = 100.0


def hung(**sections: dict[str, object]) -> CableRobot:
    """Return a mass on one vertical cable whose motor is locked."""
    return body(
        exits=((0.0, 3.0),), anchors=((0.0, 0.0),), home=(0.0, 1.0), locked=True,
        pretension_N=LOAD_N, mass_kg=LOAD_N / 9.80665, platform={"air_Ns_m": 100.0}, **sections,
    )  # fmt: skip


def test_a_cable_creeps_by_its_shares_with_their_time_constants() -> None:
    robot = hung(cables={"creep_shares": (0.2, 0.1), "creep_times_s": (0.1, 2.0)})
    free = float(free_length_m(robot)[0])
    elastic = LOAD_N / float(robot.motors["rigidity"][0]) * free
    at, way = [], []
    for k in range(40):
        run(robot, 0.05, begin_s=k * 0.05)
        at.append(0.05 * (k + 1))
        way.append(robot.distance_m(0) - free - elastic)
    t = np.array(at)
    expected = elastic * (0.2 * (1 - np.exp(-t / 0.1)) + 0.1 * (1 - np.exp(-t / 2.0)))
    # at first the mass oscillates on the cable
    assert np.allclose(way, expected, atol=0.04 * elastic)
    assert np.allclose(way[20:], expected[20:], atol=0.003 * elastic)


def test_elasticity_of_gear_and_belt_is_in_series_with_the_cable() -> None:
    robot = hung(winding={"gear_stiffness_Nm_rad": 200.0})
    begun = float(robot.position_m[1])
    run(robot, 2.0)
    # 100 N turn a drum of 104 mm radius by 52 mrad
    assert begun - robot.position_m[1] == pytest.approx(LOAD_N * 0.104**2 / 200.0, rel=0.01)


# Weight of cables.

EXITS_m = [
    (9.0 * math.cos(angle), 9.0 * math.sin(angle), 10.0)
    for angle in (0.5 * math.pi, 7.0 * math.pi / 6.0, 11.0 * math.pi / 6.0)
]
MASS_kg, WEIGHT_N_m = 110.0, 4.0


@pytest.mark.parametrize("home_m", [(0.0, 0.0, 1.0), (1.5, 1.0, 3.0)])
def test_a_mass_on_heavy_cables_hangs_as_on_catenaries(home_m: tuple[float, ...]) -> None:
    robot = body(
        exits=EXITS_m, anchors=[(0.0, 0.0, 0.0)] * 3, home=home_m, locked=True, pretension_N=0.0,
        mass_kg=MASS_kg, weight_N_m=WEIGHT_N_m, shape={"inertia_kg_m2": (1.0, 1.0, 1.0, 0, 0, 0)},
        platform={"air_Ns_m": 400.0}, cables={"damping_s": 0.01},
    )  # fmt: skip
    run(robot, 4.0)
    assert np.linalg.norm(robot.platform["velocity"][0]) < 2e-3
    true = standing(
        EXITS_m, MASS_kg, WEIGHT_N_m, float(robot.motors["rigidity"][0]),
        lengths_m=free_length_m(robot), guess_m=home_m,
    )  # fmt: skip
    np.testing.assert_allclose(robot.tension_N, true.winch_N, rtol=5e-3)
    np.testing.assert_allclose(robot.position_m, true.position_m, atol=5e-3)
    rise = robot.tension_N - robot.motors["tension"]
    np.testing.assert_allclose(robot.motors["tension"] - rise, true.platform_N, rtol=1e-2)
    # without weight, tensions would be about a twentieth lower
    light = standing(
        EXITS_m, MASS_kg, 1e-3, float(robot.motors["rigidity"][0]),
        position_m=robot.position_m,
    )  # fmt: skip
    assert (robot.tension_N > 1.08 * light.winch_N).all()
