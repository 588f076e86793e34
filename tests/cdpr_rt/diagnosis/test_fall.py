"""A platform falling on its remaining cables moves as computed by hand."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from cdpr_rt.arrays import FloatArray
from cdpr_rt.diagnosis.predictions import PARAMETERS, WINCHES, fall
from cdpr_rt.model.cable_kernel import ANCHOR, GEOMETRY_ROWS, WEIGHT
from cdpr_rt.platform.body_kernel import CENTRE, GRAVITY, INERTIA, MASS, body_of
from tests.cdpr_rt.diagnosis.robots import hung

G_m_s2, MASS_kg, PERIOD_S = 9.80665, 2.0, 1e-3
STIFFNESS_N_m = 1e5
FAST = 1e12
"""Mass of a rotor that does not turn, kg."""


def fallen(
    start_m: tuple[float, float, float],
    exit_m: tuple[float, float, float],
    seconds: float,
    *,
    anchor_m: tuple[float, float, float] = (0.0, 0.0, 0.0),
    inertia_kg_m2: FloatArray | None = None,
    ground_m: float = -1e3,
    held_s: float = 1e3,
    misled_N: float = 0.0,
    weight_N_m: float = 0.0,
    **winch: float,
) -> FloatArray:
    """Return the poses after each cycle of 1 ms. A second, vertical cable is the broken one."""
    body = body_of(hung(((0.0,) * 3,) * 2, ((0.0,) * 3,) * 2))
    assert body[MASS] == MASS_kg and body[GRAVITY + 2] == -G_m_s2 and not body[CENTRE:INERTIA].any()
    free = np.ones(6)
    if inertia_kg_m2 is None:
        free[3:] = 0.0
    else:
        body[INERTIA:GRAVITY] = inertia_kg_m2.ravel()
    parameters: Any = np.zeros(1, PARAMETERS)
    values = {"period_s": PERIOD_S, "steps": 5, "cut": 1, "dead": -1, "up": 2}
    values |= {"held_cycles": round(held_s / PERIOD_S), "misled_N": misled_N, "friction": 0.2}
    values |= {"paying_out_m_s": 0.15, "fastest_in_m_s": 0.5, "integral_rate_1_s": 4.0}
    values |= {"ground_m": ground_m, "foot_N_m": 2e4, "foot_N_s_m": 400.0}
    for key, value in values.items():
        parameters[key] = value
    winches: Any = np.zeros(2, WINCHES)
    given = {
        "stiffness_N_m": STIFFNESS_N_m,
        "damping_N_s_m": 0.0,
        "rotor_kg": FAST,
        "high_N": 100.0,
    } | winch
    for key, value in given.items():
        winches[key] = value
    geometry = np.zeros((GEOMETRY_ROWS, 2))
    geometry[:3] = np.transpose([exit_m, (start_m[0], start_m[1], start_m[2] + 1.0)])
    geometry[ANCHOR : ANCHOR + 3, 0] = anchor_m
    geometry[WEIGHT + 2, 0] = -weight_N_m
    pose = np.vstack([start_m, np.eye(3)])
    path = np.empty((round(seconds / PERIOD_S), 4, 3))
    cycles = fall(parameters, winches, body, free, geometry, np.zeros((1, 3)), pose, path)
    return path[:cycles]


def test_a_point_on_one_cable_moves_as_a_pendulum() -> None:
    angle, length = 0.2, 1.5
    start = (length * math.sin(angle), 0.0, -length * math.cos(angle))
    half_s = math.pi * math.sqrt(length / G_m_s2) * (1.0 + angle**2 / 16.0)
    path = fallen(start, (0.0, 0.0, 0.0), half_s)
    mirrored = (-start[0], 0.0, start[2])
    assert path[-1, 0] == pytest.approx(mirrored, abs=2e-3)
    assert path[:, 0, 2].min() == pytest.approx(-length, abs=1e-3)


def test_a_body_that_turns_and_swings_conserves_energy() -> None:
    inertia, anchor_m, exit_m = np.diag([0.02, 0.05, 0.03]), (0.1, 0.2, 0.1), (0.0, 0.0, 0.5)
    path = fallen((1.0, 0.0, 0.0), exit_m, 0.8, anchor_m=anchor_m, inertia_kg_m2=inertia)
    speed = (path[2:, 0] - path[:-2, 0]) / (2.0 * PERIOD_S)
    place, R = path[1:-1, 0], path[1:-1, 1:]
    W = R.transpose(0, 2, 1) @ (path[2:, 1:] - path[:-2, 1:]) / (2.0 * PERIOD_S)
    spin = np.stack([W[:, 2, 1], W[:, 0, 2], W[:, 1, 0]], axis=1)  # in the body's frame
    kinetic = (MASS_kg * (speed**2).sum(axis=1) + spin**2 @ np.diag(inertia)) / 2.0
    away = np.linalg.norm(place + R @ anchor_m - exit_m, axis=1)
    stretch = np.maximum(away - math.dist(exit_m, np.add((1.0, 0.0, 0.0), anchor_m)), 0.0)
    energy = kinetic + MASS_kg * G_m_s2 * place[:, 2] + STIFFNESS_N_m * stretch**2 / 2.0
    assert np.linalg.norm(spin, axis=1).max() > 5.0
    assert kinetic.max() > 5.0
    assert np.abs(energy).max() < 0.02 * kinetic.max()


def test_a_platform_without_cables_falls_freely_to_the_ground() -> None:
    path = fallen((0.0, 0.0, 1.0), (0.0, 0.0, -1e3), 5.0, ground_m=0.0, stiffness_N_m=1e-9)
    t = PERIOD_S * np.arange(1, 401)
    assert path[:400, 0, 2] == pytest.approx(1.0 - G_m_s2 * t**2 / 2.0, abs=2e-3)
    assert len(path) * PERIOD_S < 3.0
    assert path[-1, 0] == pytest.approx((0.0, 0.0, 0.0), abs=2e-3)


@pytest.mark.parametrize(("friction_N", "braked_N"), [(0.0, 0.0), (3.0, 3.0)])
def test_a_motor_yields_to_a_load_above_its_torque_and_friction(
    friction_N: float, braked_N: float
) -> None:
    path = fallen(
        (0.0, 0.0, 0.0), (0.0, 0.0, 2.0), 0.5, rotor_kg=3.0, held_N=10.0, friction_N=friction_N
    )
    acceleration = (MASS_kg * G_m_s2 - 10.0 - braked_N) / (MASS_kg + 3.0)
    assert -path[-1, 0, 2] == pytest.approx(acceleration * 0.5**2 / 2.0, rel=0.02)


def test_a_heavy_cable_accelerates_the_fall_with_its_weight() -> None:
    # half on the platform, half at the winch: (M + m) s" = M g - T + w (s + l), l at the start
    rotor_kg, held_N, w, length_m, seconds = 3.0, 10.0, 4.0, 2.0, 0.5
    path = fallen(
        (0.0, 0.0, 0.0), (0.0, 0.0, length_m), seconds, rotor_kg=rotor_kg, held_N=held_N,
        weight_N_m=w,
    )  # fmt: skip
    rate = math.sqrt(w / (MASS_kg + rotor_kg))
    first = (MASS_kg * G_m_s2 - held_N) / w + length_m
    assert -path[-1, 0, 2] == pytest.approx(first * (math.cosh(rate * seconds) - 1.0), rel=0.02)


def test_a_winch_with_enough_friction_keeps_its_load() -> None:
    path = fallen((0.0, 0.0, 0.0), (0.0, 0.0, 2.0), 0.5, rotor_kg=3.0, held_N=10.0, friction_N=12.0)
    assert np.abs(path[:, 0]).max() < 1e-3


def test_the_remaining_cables_lower_the_platform_at_lowering_speed() -> None:
    path = fallen(
        (0.0, 0.0, 0.0), (0.0, 0.0, 2.0), 6.0, held_s=0.02, rotor_kg=0.2, gain_N_s_m=20.0,
        held_N=MASS_kg * G_m_s2, weight_N=MASS_kg * G_m_s2, damping_N_s_m=100.0,
    )  # fmt: skip
    assert path[5000, 0, 2] - path[-1, 0, 2] == pytest.approx(0.15 * 0.999, abs=2e-3)


def test_an_undetected_loss_pulls_the_platform_away_from_the_lost_cable() -> None:
    pushed = fallen((0.0, 0.0, 0.0), (0.0, 0.0, -1.0), 0.2, stiffness_N_m=1e-9, misled_N=10.0)
    falling = fallen((0.0, 0.0, 0.0), (0.0, 0.0, -1.0), 0.2, stiffness_N_m=1e-9)
    further_m = falling[-1, 0, 2] - pushed[-1, 0, 2]
    assert further_m == pytest.approx(10.0 / MASS_kg * 0.2**2 / 2.0, rel=0.02)
