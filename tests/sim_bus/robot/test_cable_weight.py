"""The weight of the cables in the platform's equilibrium, against elastic catenaries."""

from __future__ import annotations

import math

import numpy as np
import pytest

from tests.heavy_cables import standing
from tests.sim_bus.robot.body_lab import body, free_length_m, run

EXITS_m = [
    (9.0 * math.cos(angle), 9.0 * math.sin(angle), 10.0)
    for angle in (0.5 * math.pi, 7.0 * math.pi / 6.0, 11.0 * math.pi / 6.0)
]
MASS_kg, WEIGHT_N_m = 110.0, 4.0


@pytest.mark.parametrize("home_m", [(0.0, 0.0, 1.0), (1.5, 1.0, 3.0)])
def test_a_mass_on_heavy_cables_stands_as_on_catenaries(home_m: tuple[float, ...]) -> None:
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
    # without weight they would have some twentieth less
    light = standing(
        EXITS_m, MASS_kg, 1e-3, float(robot.motors["rigidity"][0]),
        position_m=robot.position_m,
    )  # fmt: skip
    assert (robot.tension_N > 1.08 * light.winch_N).all()
