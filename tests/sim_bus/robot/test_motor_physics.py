"""The motor agrees with an independent stiff solver and with laws of mechanics."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from cdpr_sim_bus.robot import servo
from cdpr_sim_bus.robot.motor import Sample
from cdpr_sim_bus.robot.plant import Plant
from tests.sim_bus.robot.bare_motor import Motor
from tests.sim_bus.robot.plant_torques import cogging_Nm, friction_Nm

COLD = {"cogging_per_K": 0.0, "friction_per_K": 0.0}


def plant(**sections: Any) -> Plant:
    return Plant.model_validate({"thermal": COLD, **sections})


def step_torque(motor: Motor, dt_s: float, torque_Nm: float) -> Sample:
    """Advance by `dt_s` under a torque command, rounded to per mille of rated."""
    permille = round(1000.0 * torque_Nm / motor.ratings.rated_torque_Nm)
    return motor.step(dt_s, servo.TORQUE, float(permille))


def swing(p: Plant, angle_rad: float) -> float:
    """Return torque relative to its mean at the same current."""
    x = 6 * p.ripple.pole_pairs * angle_rad + math.radians(p.ripple.phase_deg)
    return 1 + p.ripple.sixth * math.sin(x) + p.ripple.twelfth * math.sin(2 * x)


def reference(p: Plant, torque_Nm: Any, duration_s: float) -> np.ndarray:
    """Return angle, velocity, bristle state and current after `duration_s`, by a stiff solver."""
    f, J = p.friction, p.inertia_kg_m2
    bandwidth = 2 * math.pi * p.drive.current_loop_bandwidth_Hz

    def rate(t: float, y: np.ndarray) -> list[float]:
        angle, v, z, current = y
        side = 1 + math.copysign(1.0, v) * f.direction_asymmetry / 2
        g = side * (1 + f.angle_share * math.sin(angle + math.radians(f.angle_phase_deg)))
        g *= f.coulomb_Nm + (f.breakaway_Nm - f.coulomb_Nm) * math.exp(
            -((v / f.stribeck_rad_s) ** 2)
        )
        dz = v - f.sigma0_Nm_rad * abs(v) / g * z
        friction = f.sigma0_Nm_rad * z + f.sigma1_Nms_rad * dz + f.viscous_Nms_rad * v
        cogging = sum(
            c.amplitude_Nm * math.sin(c.order * angle + math.radians(c.phase_deg))
            for c in p.cogging
            if c.kind == "torque"
        )
        offset = sum(
            c.amplitude_Nm * math.sin(c.order * angle + math.radians(c.phase_deg))
            for c in p.cogging
            if c.kind == "current_offset"
        )
        torque = (1 + p.motor.torque_constant_error) * current * swing(p, angle)
        return [
            v,
            (torque - cogging - friction) / J,
            dz,
            bandwidth * (torque_Nm(t) - offset - current),
        ]

    start = [math.radians(p.motor.initial_angle_deg), 0.0, 0.0, 0.0]
    solution = solve_ivp(
        rate, (0, duration_s), start, "Radau", rtol=1e-8, atol=1e-10, max_step=1e-3
    )
    return solution.y[:, -1]


@pytest.mark.parametrize(("refined", "tolerance"), [(1, 5e-3), (10, 5e-4)])
@pytest.mark.parametrize(
    "sections",
    [
        {},
        {"cogging": ({"order": 24, "amplitude_Nm": 0.03, "kind": "current_offset"},)},
        {
            "friction": {
                "sigma0_Nm_rad": 400.0,
                "sigma1_Nms_rad": 0.2,
                "direction_asymmetry": 0.6,
                "angle_share": 0.0,
            }
        },
        {"friction": {"coulomb_Nm": 0.02, "breakaway_Nm": 0.03, "stribeck_rad_s": 0.05}},
        {"load": {"inertia_kg_m2": 2e-3}},
        {
            "ripple": {"sixth": 0.1, "twelfth": 0.05, "pole_pairs": 3},
            "friction": {"angle_share": 0.5, "angle_phase_deg": 200.0},
        },
    ],
)
def test_motion_agrees_with_a_stiff_solver(
    sections: dict[str, Any], refined: int, tolerance: float
) -> None:
    p = plant(**sections)
    motor = Motor(p)
    motor.record["steps_per_control"] *= refined
    steps = [0.0, 0.15, 0.24, 0.24, -0.15, -0.3, 0.3, 0.0]
    angles, speeds = [], []
    for torque in steps:
        for _ in range(20):
            sample = step_torque(motor, 1e-3, torque)
            angles.append(sample.angle_rad)
            speeds.append(abs(sample.velocity_rad_s))
    duration = 0.02 * len(steps)
    angle, velocity, _, _ = reference(p, lambda t: steps[min(7, int(t / 0.02))], duration)
    span = max(angles) - min(angles)
    assert span > 0.1
    assert sample.angle_rad == pytest.approx(angle, abs=tolerance * span)
    assert sample.velocity_rad_s == pytest.approx(velocity, abs=tolerance * max(speeds))


@settings(max_examples=30)
@given(
    velocity=st.floats(0.05, 60.0),
    forward=st.booleans(),
    asymmetry=st.floats(-0.8, 0.8),
    coulomb=st.floats(0.01, 0.3),
    ratio=st.floats(1.0, 1.6),
)
def test_steady_friction_follows_the_stribeck_curve(
    velocity: float, forward: bool, asymmetry: float, coulomb: float, ratio: float
) -> None:
    p = plant(
        cogging=(),
        motor={"torque_constant_error": 0.0, "inertia_kg_m2": 10.0},
        friction={
            "coulomb_Nm": coulomb,
            "breakaway_Nm": coulomb * ratio,
            "direction_asymmetry": asymmetry,
        },
    )
    motor = Motor(p)
    # A heavy rotor whose speed is set at each step, until the bristle state has settled.
    travel = 12 * coulomb * ratio * 1.4 / p.friction.sigma0_Nm_rad
    for _ in range(200):
        motor.record["velocity"] = velocity if forward else -velocity
        sample = motor.step(travel / velocity / 200, servo.OFF, 0.0)
    expected = friction_Nm(p, sample.velocity_rad_s, angle_rad=sample.angle_rad)
    assert sample.friction_Nm == pytest.approx(float(expected), rel=0.02)


@settings(max_examples=25)
@given(
    torque=st.floats(-0.999, 0.999), sigma0=st.floats(200.0, 5000.0), asymmetry=st.floats(-0.5, 0.5)
)
def test_rotor_sticks_below_breakaway_torque_and_slips_above(
    torque: float, sigma0: float, asymmetry: float
) -> None:
    p = plant(
        cogging=(),
        motor={"torque_constant_error": 0.0},
        friction={
            "sigma0_Nm_rad": sigma0,
            "sigma1_Nms_rad": 2 * math.sqrt(sigma0 * 1.13e-4),
            "direction_asymmetry": asymmetry,
        },
    )
    side = 1 + math.copysign(1.0, torque) * asymmetry / 2
    hold = p.friction.breakaway_Nm * side

    def settle(demand_Nm: float) -> tuple[float, float]:
        motor = Motor(p)
        for k in range(600):  # raised slowly: a step would carry the rotor over the peak
            motor.step(1e-3, servo.TORQUE, min(1.0, k / 400) * demand_Nm / 3.0 * 1e3)
        return float(motor.record["velocity"][0]), float(motor.record["angle"][0])

    velocity, angle = settle(torque * hold * 0.97)
    assert abs(velocity) < 1e-3
    assert abs(angle) <= 3 * hold / sigma0
    velocity, _ = settle(math.copysign(1.06 * hold, torque))
    assert velocity * torque >= 0.0
    assert abs(velocity) > 1.0


@settings(max_examples=20)
@given(speed=st.floats(1.0, 80.0), order=st.integers(1, 40), sigma0=st.floats(5.0, 2000.0))
def test_coasting_never_gains_energy(speed: float, order: int, sigma0: float) -> None:
    term = {"order": order, "amplitude_Nm": 0.05, "phase_deg": 0.0}
    p = plant(cogging=(term,), friction={"sigma0_Nm_rad": sigma0, "sigma1_Nms_rad": 0.002})
    motor = Motor(p)
    motor.record["velocity"] = speed
    m = motor.record

    def energy() -> float:
        v, z, angle = (float(m[name][0]) for name in ("velocity", "bristle", "angle"))
        stored = 0.05 / order * (1 - math.cos(order * angle))
        return 0.5 * p.inertia_kg_m2 * v**2 + 0.5 * sigma0 * z**2 + stored

    before = energy()
    first = before
    for _ in range(400):
        motor.step(5e-4, servo.OFF, 0.0)
        after = energy()
        assert after <= before + 2e-3 * first
        before = after
    assert before < 0.9 * first


def test_each_sample_obeys_newtons_law() -> None:
    p = plant()
    motor = Motor(p)
    last = step_torque(motor, 5e-5, 0.3)
    for _ in range(400):
        sample = step_torque(motor, 5e-5, 0.3)
        acceleration = (sample.velocity_rad_s - last.velocity_rad_s) / 5e-5
        # The sample shows the torque at the end of the step in which it caused the motion.
        net = sample.motor_Nm - sample.cogging_Nm - sample.friction_Nm
        assert p.inertia_kg_m2 * acceleration == pytest.approx(net, abs=2e-4)
        last = sample


def test_cogging_follows_its_formula_energised_and_off() -> None:
    p = plant(
        motor={"initial_angle_deg": 33.0},
        cogging=(
            {"order": 4, "amplitude_Nm": 0.06, "phase_deg": 17.0},
            {"order": 72, "amplitude_Nm": 0.02, "phase_deg": -80.0},
            {"order": 8, "amplitude_Nm": 0.01, "kind": "current_offset"},
        ),
    )
    motor = Motor(p)
    for k in range(300):
        sample = motor.step(1e-3, servo.VELOCITY, 3000.0 if k > 5 else 0.0)
        assert sample.cogging_Nm == pytest.approx(float(cogging_Nm(p, sample.angle_rad)), abs=6e-3)
    motor.step(0.05, servo.OFF, 0.0)
    sample = motor.step(1e-4, servo.OFF, 0.0)
    unpowered = cogging_Nm(p, sample.angle_rad, energised=False)
    assert sample.cogging_Nm == pytest.approx(float(unpowered), abs=1e-3)
    assert abs(float(unpowered) - float(cogging_Nm(p, sample.angle_rad))) > 1e-4


def test_torque_constant_error_changes_the_motion_but_not_the_reported_torque() -> None:
    p = plant(cogging=(), motor={"torque_constant_error": 0.2, "inertia_kg_m2": 0.1})
    motor = Motor(p)
    sample = step_torque(motor, 0.05, 1.5)
    assert sample.torque_units == 500
    assert sample.motor_Nm == pytest.approx(1.8 * swing(p, sample.angle_rad), rel=1e-5)


def test_current_loop_is_a_first_order_lag() -> None:
    p = plant(
        drive={"current_loop_bandwidth_Hz": 100.0},
        motor={"torque_constant_error": 0.0},
        ripple={"sixth": 0.0, "twelfth": 0.0},
    )
    motor = Motor(p)
    for t in (1e-3, 2e-3, 3e-3):
        sample = step_torque(motor, 1e-3, 3.0)
        assert sample.motor_Nm == pytest.approx(
            3 * (1 - math.exp(-2 * math.pi * 100 * t)), rel=1e-6
        )


def test_warming_scales_cogging_and_friction() -> None:
    p = Plant.model_validate(
        {
            "motor": {"inertia_kg_m2": 10.0},
            "thermal": {"time_constant_s": 1.0, "rise_K": 20.0, "cogging_per_K": -0.01},
            "friction": {"direction_asymmetry": 0.0},
        }
    )
    motor = Motor(p)
    motor.record["velocity"] = 5.0
    for t in (1.0, 2.0, 3.0):
        for _ in range(1000):
            sample = step_torque(motor, 1e-3, 0.0)
        assert sample.rise_K == pytest.approx(20 * (1 - math.exp(-t)), rel=1e-3)
        cogging = cogging_Nm(p, sample.angle_rad, rise_K=sample.rise_K)
        assert sample.cogging_Nm == pytest.approx(float(cogging), abs=3e-4)
        friction = friction_Nm(
            p, sample.velocity_rad_s, angle_rad=sample.angle_rad, rise_K=sample.rise_K
        )
        assert sample.friction_Nm == pytest.approx(float(friction), rel=2e-3)
    for _ in range(5000):
        sample = motor.step(1e-3, servo.OFF, 0.0)
    assert sample.rise_K < 0.2


def test_the_same_seed_gives_the_same_readings() -> None:
    def readings(seed: int) -> list[int]:
        motor = Motor(Plant(seed=seed))
        return [step_torque(motor, 1e-3, 0.3).counts for _ in range(200)]

    assert readings(3) == readings(3)
    assert readings(3) != readings(4)


def test_result_hardly_depends_on_the_cycle_time() -> None:
    angles = []
    for dt, n in ((1e-3, 240), (3e-4, 800), (4e-3, 60)):
        motor = Motor(Plant())
        for _ in range(n):
            sample = step_torque(motor, dt, 0.18)
        angles.append(sample.angle_rad)
    assert angles[0] > 1.0
    assert np.ptp(angles) < 2e-3 * angles[0]


@pytest.mark.parametrize("units", [100.0, -400.0])
def test_torque_ripple_has_orders_6_and_12_per_electrical_turn(units: float) -> None:
    p = plant(cogging=(), ripple={"sixth": 0.03, "twelfth": 0.02, "phase_deg": 0.0})
    motor = Motor(p)
    motor.step(0.01, servo.TORQUE, units)
    mean = units * 3e-3 * 1.04
    motor.record["inertia"] = 1e9  # the rotor is turned by the test
    found = []
    angles = np.arange(256) / 256 * 2 * math.pi
    for angle in angles:
        motor.record["angle"] = angle
        found.append(motor.step(5e-5, servo.TORQUE, units).motor_Nm)
    waves = np.fft.rfft(found) / 256
    assert waves[0].real == pytest.approx(mean, rel=1e-6)
    assert 2 * waves[24] / mean == pytest.approx(-0.03j, abs=1e-6)
    assert 2 * waves[48] / mean == pytest.approx(-0.02j, abs=1e-6)
    others = np.delete(np.abs(waves), [0, 24, 48])
    assert others.max() < 1e-9


def test_friction_varies_once_per_turn() -> None:
    given = {"coulomb_Nm": 0.1, "angle_share": 0.2, "angle_phase_deg": 30.0}
    p = plant(
        cogging=(), motor={"inertia_kg_m2": 10.0}, friction={**given, "direction_asymmetry": 0.0}
    )
    motor = Motor(p)
    motor.record["velocity"] = 10.0
    samples = [motor.step(1e-3, servo.OFF, 0.0) for _ in range(700)]
    angle = np.array([sample.angle_rad for sample in samples[10:]])
    rubbing = np.array([sample.friction_Nm for sample in samples[10:]])
    assert np.ptp(angle) > 2 * math.pi
    expected = 0.1 * (1 + 0.2 * np.sin(angle + math.radians(30.0))) + 10.0 * 5e-4
    assert np.allclose(rubbing, expected, rtol=5e-3)
