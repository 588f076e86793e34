"""Programs on simulated drives with cogging, friction and a load, in lockstep."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest

from cdpr_rt.core.cycle_row import Row
from cdpr_rt.core.states import LoopState
from tests.tools.daemon.loop_rig import LoopRig, opened
from tests.tools.robot_rig import robot_file, simulated

PERIOD_S = 1e-3
MASS_KG, DRUM_M, GEAR = 5.0, 0.104, 4.0


@pytest.fixture(scope="module")
def rig(tmp_path_factory: pytest.TempPathFactory) -> Iterator[LoopRig]:
    """Yield two winches, each with a mass half a metre above the floor on a barely slack cable."""
    folder = tmp_path_factory.mktemp("robot")
    path = robot_file(folder, [("can0", 1), ("can0", 2)], period_s=PERIOD_S)
    plant = folder / "plant.toml"
    plant.write_text(f'[load]\nkind = "hung_mass"\nmass_kg = {MASS_KG}\nslack_m = 0.2\n')
    with simulated(path, "--plant", str(plant)) as url, opened(path, url) as made:
        made.obeyed("enable")
        yield made


def error_deg(rows: Row, seconds: float) -> np.ndarray:
    last = rows[-round(seconds / PERIOD_S) :]
    return np.degrees(last["setpoint_rad"] - last["position_rad"])


def test_motors_reach_their_target_despite_cogging_and_friction(rig: LoopRig) -> None:
    for distance in ([3.0, -1.0], [-3.4, 2.0], [0.3, 0.4]):
        rig.obeyed("program", program="pid", wanted={"distance_rad": distance})
        rows = rig.run(3.0)
        assert rig.loop.engine.program.at_rest
        # friction of 0.1 Nm and cogging divided by the gain, reduced by the integral
        assert np.max(np.abs(error_deg(rows, 0.5))) < 4.0
        assert np.max(np.ptp(error_deg(rows, 0.5), axis=0)) < 2.0


def test_a_mass_is_lifted_and_held_through_changes_of_programs(rig: LoopRig) -> None:
    """The mass has the inertia of fifty rotors. Oscillations decay, and no change drops it."""
    up_rad = 0.4 / (DRUM_M / GEAR)  # 0.2 m of slack first
    gently = {"distance_rad": [-up_rad, 0.0], "speed_rad_s": 5.0}
    rig.obeyed("program", program="pid", wanted=gently)
    rig.run(8.0)
    weight_Nm = MASS_KG * 9.81 * DRUM_M / GEAR
    held = rig.run(0.5)
    assert rig.state is LoopState.ACTIVE, rig.status
    assert np.mean(held["torque_sent_Nm"][:, 0]) == pytest.approx(-weight_Nm, abs=0.25)
    rig.rows()
    still = {"jog": {"velocity_rad_s": [0.0, 0.0]}, "pid": {"distance_rad": [None, None]}}
    for name in ("hold", "jog", "pid", "follow", "hold"):
        rig.obeyed("program", program=name, wanted=still.get(name, {}))
        rig.turn(100)
    rows = rig.rows()
    assert len(np.unique(rows["program"])) == 4
    assert np.max(np.abs(error_deg(rows, 0.5)[:, 0])) < 5.0
    steps = np.abs(np.diff(rows["torque_sent_Nm"], axis=0))
    switched = np.diff(rows["program"].astype(int)) != 0
    # no larger at changes of programs than elsewhere
    assert steps[switched].max() <= max(steps[~switched].max(), 0.01)
    rig.obeyed("program", program="pid", wanted={"distance_rad": [up_rad, 0.0]})
    rig.run(6.0)
    assert np.max(np.abs(error_deg(rig.run(0.2), 0.2))) < 4.0
