"""The physics of the platform obeys conservation laws and statics."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.optimize import brentq

from cdpr_sim_bus.robot import servo
from cdpr_sim_bus.robot.motor import cable_force
from tests.sim_bus.robot.body_lab import ANCHORS_m, EXITS_m, body, energy_J, free_length_m, run

ROOM_EXITS_m = [(x, y, z) for z in (0.0, 3.0) for x in (-2.5, 2.5) for y in (-2.0, 2.0)]
ROOM_ANCHORS_m = [(x, y, z) for z in (-0.3, 0.3) for x in (-0.1, 0.1) for y in (-0.1, 0.1)]


@pytest.mark.parametrize("locked", [True, False])
def test_energy_is_conserved(locked: bool) -> None:
    robot = body(locked=locked)
    robot.platform["velocity"][0, :2] = 0.3, 0.1
    begin, lowest, highest = energy_J(robot), math.inf, -math.inf
    for k in range(300):
        run(robot, 1e-3, begin_s=k * 1e-3)
        lowest, highest = min(lowest, energy_J(robot)), max(highest, energy_J(robot))
    moved = 0.5 * 4.0 * (0.3**2 + 0.1**2)
    assert highest - begin < 0.05 * moved
    assert begin - lowest < 0.05 * moved


@pytest.mark.parametrize("order", [(1, 2, 0), (2, 1, 0)])
def test_the_order_of_the_drives_does_not_change_the_motion(order: tuple[int, ...]) -> None:
    """Commands of all buses act from the same instant."""
    states = []
    torque = [0.0, 0.0, 0.0]
    for turn in ((0, 1, 2), order):
        robot = body(smooth=False)
        robot.commands = [lambda i=i: (servo.TORQUE, torque[i]) for i in range(3)]
        for k in range(1, 50):
            torque[:] = 5.0 * k, 300.0 - 4.0 * k, 100.0 * (k % 2)
            samples = {i: robot.step(i, k * 1e-3) for i in turn}
        states.append((robot.platform.tobytes(), robot.motors.tobytes(), sorted(samples.items())))
    assert states[0] == states[1]


def test_damping_and_friction_only_remove_energy() -> None:
    robot = body(smooth=False, cables={"damping_s": 0.002, "friction_share": 0.05})
    robot.platform["velocity"][0, 0] = 0.5
    last = energy_J(robot)
    begin = last
    for k in range(100):
        run(robot, 5e-3, begin_s=k * 5e-3)
        now = energy_J(robot)
        assert now < last + 1e-3
        last = now
    assert last < begin - 0.2


def test_a_free_body_keeps_momentum_angular_momentum_and_energy() -> None:
    robot = body(exits=ROOM_EXITS_m, anchors=ROOM_ANCHORS_m, home=(0.0, 0.0, 1.5))
    for i in range(8):
        robot.cut(i)
    p = robot.platform[0]
    p["gravity"] = (0.0, 0.0, -1e-12)
    p["inertia"] = np.diag((0.02, 0.05, 0.11))
    p["inverse_inertia"] = np.linalg.inv(p["inertia"])
    p["velocity"] = (0.3, -0.2, 0.1)
    p["spin"] = (0.4, 3.0, -0.5)

    def momentum() -> np.ndarray:
        return np.asarray(p["rotation"] @ p["inertia"] @ p["rotation"].T @ p["spin"])

    before, kinetic = momentum(), energy_J(robot)
    run(robot, 2.0)
    assert np.allclose(p["velocity"], (0.3, -0.2, 0.1), atol=1e-6)
    assert np.allclose(momentum(), before, atol=2e-3 * np.linalg.norm(before))
    assert energy_J(robot) == pytest.approx(kinetic, rel=2e-3)
    assert np.allclose(p["rotation"] @ p["rotation"].T, np.eye(3), atol=1e-9)
    assert abs(float(np.dot(p["rotation"][:, 2], (0.0, 0.0, 1.0)))) < 0.999, "the body has tumbled"


@pytest.mark.parametrize("room", [False, True])
def test_tensions_at_rest_balance_the_weight(room: bool) -> None:
    points = (
        (ROOM_EXITS_m, ROOM_ANCHORS_m, (0.1, 0.2, 1.4))
        if room
        else (EXITS_m, ANCHORS_m, (0.2, 1.5))
    )
    robot = body(
        exits=points[0], anchors=points[1], home=points[2], locked=True,
        cables={"damping_s": 0.02}, platform={"air_Ns_m": 60.0},
    )  # fmt: skip
    run(robot, 3.0)
    p, t = robot.platform[0], robot.tension_N
    assert np.linalg.norm(p["velocity"]) < 1e-6
    forces = t[:, None] * p["way"][: robot.n]
    arms = p["arm"][: robot.n]
    weight = p["mass"] * p["gravity"]
    assert np.allclose(forces.sum(axis=0) + weight, 0.0, atol=1e-3)
    assert np.allclose(np.cross(arms, forces).sum(axis=0), 0.0, atol=1e-3)
    assert np.linalg.norm(weight) > 30.0


def test_a_cut_cable_has_no_tension_and_the_platform_swings_on_the_others() -> None:
    robot = body(locked=True, cables={"damping_s": 0.002})
    run(robot, 0.05)
    robot.cut(0)
    run(robot, 0.4, begin_s=0.05)
    assert robot.tension_N[0] < 1e-3
    x, y, _ = robot.position_m
    assert y < 1.5 - 0.1, "the platform falls"
    reach = np.hypot(x - 2.0, y - 3.0)
    assert reach < free_length_m(robot)[1] + 0.2, "the remaining cable holds it"
    robot.mend(0, cut=True, slipped_m=0.0)
    slack_m = free_length_m(robot)[0] - robot.distance_m(0)
    assert slack_m == pytest.approx(0.0, abs=1e-9), "its old length would pull"
    highest_N = 0.0
    for k in range(20):  # it swings on both
        run(robot, 0.05, begin_s=0.45 + 0.05 * k)
        highest_N = max(highest_N, float(robot.tension_N[0]))
    assert highest_N > 5.0


def test_a_mended_slip_is_undone_as_far_as_the_cable_is_slack() -> None:
    robot = body(locked=True, cables={"damping_s": 0.002})
    run(robot, 0.05)
    start_m = float(robot.motors["cable_start"][0])
    robot.slip(0, 0.1)
    robot.mend(0, cut=False, slipped_m=0.1)
    assert robot.motors["cable_start"][0] == pytest.approx(robot.distance_m(0))
    robot.motors["cable_start"][0] = start_m
    robot.slip(0, 0.001)
    robot.mend(0, cut=False, slipped_m=0.001)
    assert robot.motors["cable_start"][0] == pytest.approx(start_m + 0.001), "it is tight"


def test_a_fallen_platform_is_put_back_at_rest_with_slack_cables() -> None:
    floor = {"present": True, "friction": 0.3}
    robot = body(pretension_N=0.0, start={"slack_m": 0.05}, floor=floor)
    run(robot, 0.3)
    start_m = robot.position_m
    robot.cut(0)
    robot.platform["velocity"][0, :2] = 1.5, 2.0
    run(robot, 0.8, begin_s=0.3)
    assert np.linalg.norm(robot.position_m - start_m) > 0.3
    robot.mend(0, cut=True, slipped_m=0.0)
    robot.put_back()
    np.testing.assert_allclose(robot.position_m, start_m, atol=1e-3)
    assert not robot.platform["velocity"].any()
    run(robot, 0.3, begin_s=1.1)
    np.testing.assert_allclose(robot.position_m, start_m, atol=2e-3)
    assert robot.tension_N.max() < 1.0


def test_winches_without_power_turn_when_the_platform_is_carried_back() -> None:
    robot = body(pretension_N=0.0, start={"slack_m": 0.05})
    run(robot, 0.3)
    motor, start_m = robot.motors[0], robot.motors["cable_start"].copy()
    motor["kind"] = servo.OFF
    motor["angle"] -= 1.0 / motor["cable_gain"]  # wound in by 1 m
    robot.put_back()
    np.testing.assert_array_equal(robot.motors["cable_start"], start_m)
    paid_out_m = motor["cable_gain"] * (motor["angle"] - motor["angle_start"])
    assert start_m[0] + paid_out_m == pytest.approx(robot.distance_m(0) + 0.05)


@pytest.mark.parametrize("length_m", [0.05, 0.2, 1.0])
def test_stiff_short_cables_stay_stable(length_m: float) -> None:
    exits = ((-length_m - 0.075, 1.5433), (length_m + 0.075, 1.5433), (0.0, 1.4134 - length_m))
    robot = body(exits=exits, home=(0.0, 1.5), smooth=False, cables={"damping_s": 0.0005})
    robot.platform["velocity"][0, 0] = 0.5
    begin = energy_J(robot)
    run(robot, 0.5, torque_units=-300.0)
    # work of the motors: 0.9 Nm times the small angle
    turned = float(np.abs(robot.motors["angle"] - robot.motors["angle_start"]).sum())
    assert energy_J(robot) - begin < 1.0 * turned + 0.5
    assert np.isfinite(robot.position_m).all()


@pytest.mark.parametrize("damping_s", [0.0, 0.002, 0.05])
@pytest.mark.parametrize("mass_kg", [0.1, 4.0])
def test_light_platforms_and_strong_damping_stay_stable(damping_s: float, mass_kg: float) -> None:
    exits = ((-0.125, 1.5433), (0.125, 1.5433), (0.0, 1.3634))
    robot = body(
        exits=exits, home=(0.0, 1.5), mass_kg=mass_kg, locked=True, pretension_N=200.0,
        cables={"damping_s": damping_s},
    )  # fmt: skip
    robot.platform["velocity"][0, :2] = 0.5, 0.2
    begin = energy_J(robot)
    for k in range(50):
        run(robot, 1e-3, begin_s=k * 1e-3)
        assert energy_J(robot) < begin + 0.02 * mass_kg


def test_the_floor_carries_a_slack_platform() -> None:
    robot = body(
        pretension_N=0.0, start={"slack_m": 0.05}, floor={"present": True}, weight_N_m=0.122
    )
    run(robot, 1.0)
    assert np.linalg.norm(robot.platform["velocity"][0]) < 1e-3
    assert robot.position_m[:2] == pytest.approx((0.2, 1.5), abs=2e-5)
    # the weight of a slack cable of about 2 m
    assert 0.0 < robot.tension_N.max() < 3.0


@pytest.mark.parametrize("share", [0.7, 1.3])
def test_a_platform_on_the_floor_slips_only_beyond_its_friction(share: float) -> None:
    friction_m_s2 = 0.3 * 9.80665
    floor = {"present": True, "friction": 0.3}
    robot = body(pretension_N=0.0, start={"slack_m": 0.05}, floor=floor)
    run(robot, 0.3)
    begun_m = robot.position_m[0]
    for k in range(300):
        robot.platform["velocity"][0, 0] += 1e-3 * share * friction_m_s2
        run(robot, 1e-3, begin_s=0.3 + 1e-3 * k)
    way_m = robot.position_m[0] - begun_m
    if share < 1.0:
        assert abs(way_m) < 5e-5
    else:
        assert way_m == pytest.approx(0.5 * (share - 1.0) * friction_m_s2 * 0.3**2, rel=0.1)


@pytest.mark.parametrize("tension_N", [5.0, 20.0, 60.0])
@pytest.mark.parametrize("span_m", [1.0, 3.0])
def test_a_sagging_cable_is_a_catenary(tension_N: float, span_m: float) -> None:
    weight, rigidity = 0.122, 40_000.0

    def unstretched(t: float) -> float:
        # elastic catenary between level ends with horizontal tension t: length minus mean stretch
        a = t / weight
        length = 2.0 * a * math.sinh(span_m / (2.0 * a))
        mean = t * a / length * (span_m / (2.0 * a) + math.sinh(span_m / a) / 2.0) * 2.0 / 2.0
        return length - length * mean / (rigidity + mean)

    free = unstretched(tension_N)
    found, slope = cable_force(
        span_m - free, rigidity / free, (weight * free) ** 2 * free / 24.0, 1.0
    )
    assert found == pytest.approx(tension_N, rel=0.02)
    stretch = 1e-6
    more = brentq(lambda t: span_m - unstretched(t) - (span_m - free + stretch), 1.0, 200.0)
    assert slope == pytest.approx((more - tension_N) / stretch, rel=0.05)


@pytest.mark.parametrize("stretch_m", [-0.5, -0.01, 0.0, 1e-4, 1e-2])
@pytest.mark.parametrize("last_N", [0.0, 1.0, 5000.0])
def test_the_cable_force_converges_from_any_previous_tension(
    stretch_m: float, last_N: float
) -> None:
    k, sag = 2e4, 0.122**2 * 8.0 / 24.0
    t, slope = cable_force(stretch_m, k, sag, last_N)
    assert t / k - sag / t**2 == pytest.approx(stretch_m, abs=1e-9)
    assert slope > 0.0
    assert cable_force(-abs(stretch_m), k, 0.0, last_N)[0] == 0.0
