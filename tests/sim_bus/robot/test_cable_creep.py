"""Creep of a cable, and what gear and belt yield."""

from __future__ import annotations

import numpy as np
import pytest
from body_lab import body, free_length_m, run

from cdpr_sim_bus.robot.cable_robot import CableRobot

LOAD_N = 100.0


def hung(**sections: dict[str, object]) -> CableRobot:
    """A mass on one vertical cable whose motor is locked."""
    return body(
        exits=((0.0, 3.0),), anchors=((0.0, 0.0),), home=(0.0, 1.0), locked=True,
        pretension_N=LOAD_N, mass_kg=LOAD_N / 9.80665, platform={"air_Ns_m": 100.0}, **sections,
    )  # fmt: skip


def test_a_cable_creeps_by_its_shares_in_their_times() -> None:
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
    # it swings a little on its cable at first
    assert np.allclose(way, expected, atol=0.04 * elastic)
    assert np.allclose(way[20:], expected[20:], atol=0.003 * elastic)


def test_gear_and_belt_yield_in_series_with_the_cable() -> None:
    robot = hung(winding={"gear_stiffness_Nm_rad": 200.0})
    begun = float(robot.position_m[1])
    run(robot, 2.0)
    # 100 N at a drum of 104 mm turn it by 52 mrad
    assert begun - robot.position_m[1] == pytest.approx(LOAD_N * 0.104**2 / 200.0, rel=0.01)
