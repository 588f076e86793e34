"""A robot whose cables weigh a third of its platform: planned tensions beside the true ones."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from cdpr_profiles import load_robot
from cdpr_rt.robots.statics import statics_of
from cdpr_tools.trials.lockstep import LockstepRobot
from tests.heavy_cables import standing

HEIGHT_m, MASS_kg, WEIGHT_N_m, STRAIN_per_N = 1.5, 110.0, 4.0, 2e-7
PLACE_m = (0.4, -0.3, HEIGHT_m)
FILES = {
    "servo.toml": """
model = "Big servo"
poles = 10
torque_constant_Nm_per_Arms = 0.92
rated_torque_Nm = 6.5
stall_torque_Nm = 9.86
peak_torque_Nm = 28.0
rated_current_Arms = 7.6
stall_current_Arms = 10.7
peak_current_Arms = 33.9
rated_speed_rpm = 3850
resistance_ohm = 0.9
inductance_H = 0.005
rotor_inertia_kg_m2 = 5.2e-4
""",
    "steel.toml": f"""
name = "steel"
material = "steel"
diameter_m = 0.01
weight_per_length_N_m = {WEIGHT_N_m}
elongation_percent_per_N = {100.0 * STRAIN_per_N}
breaking_force_kgf = 6300
min_tension_N = 100
""",
    "winch.toml": """
name = "winch"
motor = "servo"
drive = "generic-cia402"
cable = "steel"
gear_ratio = 20
drum_radius_m = 0.15
cable_sign = 1
encoder_counts_per_turn = 16384
node_id = 1
master_node_id = 127
bitrate_bit_s = 1000000
sync_period_s = 0.002
""",
    "plant.toml": """
[cables]
friction_share = 0.0
[variation]
torque_constant = 0.0
""",
}
EXITS_m = [(0.0, 9.0, 10.0), (-7.794, -4.5, 10.0), (7.794, -4.5, 10.0)]
AXIS = """
[[axes]]
winch = "winch"
bus = "b0"
node_id = {node}
name = "c{node}"
exit_point_m = {exit}
anchor_point_m = [0.0, 0.0, 0.0]
"""
ROBOT = f"""
name = "heavy"
sync_period_s = 0.002
master_node_id = 127
[[buses]]
name = "b0"
[platform]
mass_kg = {MASS_kg}
home_m = [0.0, 0.0, 1.0]
workspace_min_m = [-1.0, -1.0, 1.2]
workspace_max_m = [1.0, 1.0, 2.5]
speed_m_s = 0.4
acceleration_m_s2 = 0.3
cable_model = "catenary"
[limits]
torque_Nm = 9.0
tension_min_N = 150.0
tension_max_N = 1000.0
speed_rad_s = 120.0
""" + "".join(AXIS.format(node=i + 1, exit=list(exit)) for i, exit in enumerate(EXITS_m))


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder: Path = tmp_path_factory.mktemp("heavy")
    for name, text in (FILES | {"heavy.toml": ROBOT}).items():
        (folder / name).write_text(text)
    return folder


@pytest.fixture(scope="module")
def held(folder: Path) -> Iterator[LockstepRobot]:
    with LockstepRobot(folder / "heavy.toml", plant=folder / "plant.toml") as robot:
        robot.enable()
        robot.carry_out("tighten", 60.0)
        robot.carry_out("pose", position_m=list(PLACE_m))
        robot.run(5.0)
        yield robot


@pytest.mark.parametrize("place_m", [(0.0, 0.0, 1.0), PLACE_m, (-1.0, 1.0, 2.5)])
def test_tensions_are_those_of_catenaries(folder: Path, place_m: tuple[float, ...]) -> None:
    statics = statics_of(load_robot(folder / "heavy.toml"))
    planned_N = statics.tensions_N(np.array(place_m))
    true = standing(EXITS_m, MASS_kg, WEIGHT_N_m, 1.0 / STRAIN_per_N, position_m=place_m)
    rise_N = 0.5 * WEIGHT_N_m * (10.0 - place_m[2])
    np.testing.assert_allclose(planned_N + rise_N, true.winch_N, rtol=3e-3)
    np.testing.assert_allclose(planned_N - rise_N, true.platform_N, rtol=3e-3)


@pytest.mark.long
def test_planned_tensions_are_those_of_a_platform_that_is_held(
    folder: Path, held: LockstepRobot
) -> None:
    statics = statics_of(load_robot(folder / "heavy.toml"))
    record, rows = held.truth(), held.run(1.0)
    rise_N = 0.5 * WEIGHT_N_m * (10.0 - HEIGHT_m)
    planned_N = statics.tensions_N(np.array(PLACE_m)) + rise_N
    np.testing.assert_allclose(record["tension_N"], planned_N, rtol=0.01)
    true = standing(EXITS_m, MASS_kg, WEIGHT_N_m, 1.0 / STRAIN_per_N, position_m=PLACE_m)
    np.testing.assert_allclose(record["tension_N"], true.winch_N, rtol=0.01)
    # nothing of the cables' weight is left to the loop's integral part or to what was learnt
    np.testing.assert_allclose(rows["tension_N"].mean(axis=0), planned_N, rtol=0.03)
    np.testing.assert_allclose(record["position_m"], PLACE_m, atol=0.05)
