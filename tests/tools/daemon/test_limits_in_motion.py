"""The supervisor stops a program that violates limits, on simulated drives."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from cdpr_drivers.cia402 import STATE_TABLE, State
from cdpr_profiles.places import SHIPPED
from cdpr_profiles.robot_limits import Limit
from cdpr_rt.arrays import FloatArray
from cdpr_rt.control.base import Idle
from cdpr_rt.core.cycle_row import Row
from cdpr_rt.core.exchange import AxisFeedback, Setpoint
from cdpr_rt.core.states import LoopState, Reaction
from cdpr_rt.programs.base import Program
from tests.drivers.modbus.load_cell_rig import LoadCellRig
from tests.tools.daemon.loop_rig import LoopRig, opened
from tests.tools.robot_rig import robot_file, simulated

PERIOD_S = 2e-3
LIMITS = """
[limits]
torque_Nm = 1.5
torque_rate_Nm_s = 100.0
speed_rad_s = [50.0, 40.0]
following_error_rad = 1.5
cable_length_max_m = 1.02
[limits.reactions]
following_error = "torque off"
"""
Deed = Callable[[int, AxisFeedback, Setpoint, FloatArray], None]


class Wild(Program):
    """A program that runs a function of the test. Axis 0 stays at rest."""

    name = "wild"
    needs_lease = False
    at_rest = True
    pose = pose_setpoint = None
    stream_age_s, rest_s = math.nan, 5.0
    stream_buttons = 0

    def __init__(self) -> None:
        self.controller = Idle(2)
        self.deed: Deed = lambda _k, _feedback, _setpoint, _torque: None
        self._cycles = 0

    def start(self, feedback: AxisFeedback, setpoint: Setpoint, _torque: FloatArray) -> None:
        self._cycles = 0
        setpoint.position_rad[:] = feedback.position_rad
        setpoint.velocity_rad_s[:] = 0.0

    def update(self, feedback: AxisFeedback, setpoint: Setpoint, torque_Nm: FloatArray) -> None:
        torque_Nm[:] = 0.0
        setpoint.position_rad[:] = feedback.position_rad
        self.deed(self._cycles, feedback, setpoint, torque_Nm)
        self._cycles += 1

    def stop(self) -> None:
        """Stand still from now on."""
        self.deed = lambda _k, _feedback, _setpoint, _torque: None

    def progress(self) -> dict[str, Any]:
        return {}


class WildRig(LoopRig):
    """A loop that can run the wild program."""

    def __init__(self, path: Path, url: str, **more: Any) -> None:
        self.wild = Wild()
        super().__init__(path, url, {"wild": self.wild}, **more)

    def go_wild(self, deed: Deed) -> Row:
        """Enable with the wild program running `deed`. Return the rows until the fault."""
        self.wild.deed = deed
        self.rows()
        self.obeyed("enable", program="wild")
        self.turn_until(lambda: self.state is LoopState.FAULT)
        return self.rows()


@pytest.fixture(scope="module")
def rig(tmp_path_factory: pytest.TempPathFactory) -> Iterator[WildRig]:
    path = robot_file(
        tmp_path_factory.mktemp("robot"), [("can0", 1), ("can0", 2)], period_s=PERIOD_S
    )
    path.write_text(path.read_text() + LIMITS)
    with simulated(path) as url:
        made = WildRig(path, url)
        made.boot()
        yield made
        made.close()


@pytest.fixture
def ready(rig: WildRig) -> Iterator[WildRig]:
    yield rig
    if rig.state is LoopState.FAULT:
        rig.obeyed("acknowledge")
    assert rig.state is LoopState.READY


def push(torque_Nm: float) -> Deed:
    def deed(_k: int, _feedback: AxisFeedback, _setpoint: Setpoint, torque: FloatArray) -> None:
        torque[1] = torque_Nm

    return deed


def states(row: Row) -> list[State]:
    return [State(int(STATE_TABLE[int(word) & 0x7F])) for word in row["statusword"]]


def test_drives_get_the_robots_torque_limit_and_heartbeat(ready: WildRig) -> None:
    network = ready.machine.networks["can0"]
    for node in (1, 2):
        assert network.read_int(node, 0x6072) == 500  # 1.5 Nm of 3 Nm
        assert network.read_int(node, 0x1016, 1) == 127 << 16 | 175


def test_a_runaway_motor_is_stopped_by_the_drives(ready: WildRig) -> None:
    rows = ready.go_wild(push(1.0))
    told = ready.status
    assert told["reason"].startswith("axis 2: speed ")
    assert told["reason"].endswith("2292 deg/s allowed")
    assert told["reason_limit"]["limit"] == "speed"
    assert told["reason_limit"]["value"] > told["reason_limit"]["allowed"] == pytest.approx(40.0)
    tripped = int(np.flatnonzero(rows["limit"] == Limit.SPEED)[0])
    assert rows["reaction"][tripped] == Reaction.QUICK_STOP
    assert rows["limit_axis"][tripped] == 1
    # no torque from this cycle on; the drives brake and then cut power
    assert not rows["torque_sent_Nm"][tripped:].any()
    after = [states(row) for row in rows[tripped + 1 :]]
    assert [State.QUICK_STOP] * 2 in after[:3]
    assert after[-1] == [State.SWITCH_ON_DISABLED] * 2
    speed = np.diff(rows["position_rad"][-3:, 1]) / PERIOD_S
    assert np.abs(speed).max() < 5.0


@pytest.mark.parametrize("what", [1.6, -1.6, math.nan])
def test_the_reaction_in_the_robots_file_is_executed(ready: WildRig, what: float) -> None:
    def jump(_k: int, feedback: AxisFeedback, setpoint: Setpoint, _torque: FloatArray) -> None:
        setpoint.position_rad[1] = feedback.position_rad[1] + what

    rows = ready.go_wild(jump)
    tripped = int(np.flatnonzero(rows["limit"] == Limit.FOLLOWING_ERROR)[0])
    assert rows["reaction"][tripped] == Reaction.TORQUE_OFF
    assert ready.status["reason_limit"]["reaction"] == "torque off"
    # without a quick stop
    after = [states(row) for row in rows[tripped + 1 :]]
    assert not any(State.QUICK_STOP in each for each in after)
    assert after[-1] == [State.SWITCH_ON_DISABLED] * 2


@pytest.mark.parametrize(
    "wanted",
    [
        {},
        {"cable_length_m": [1.0]},
        {"cable_length_m": 1.0},
        {"cable_length_m": [1.0, -1.0]},
        {"cable_length_m": [1.0, math.nan]},
        {"cable_length_m": [1.0, True]},
        {"cable_length_m": [1.0, "2"]},
        {"cable_length_m": [1.0, 1.0], "more": 1},
    ],
)
def test_invalid_lengths_are_rejected(ready: WildRig, wanted: dict[str, Any]) -> None:
    answer = ready.command("lengths", wanted=wanted)
    assert not answer["ok"]
    assert "allowed: " in answer["text"]
    assert not ready.loop.engine.parts.estimator.estimate.length_known.any()


def test_a_cable_beyond_its_length_is_held_and_can_return(ready: WildRig) -> None:
    estimator = ready.loop.engine.parts.estimator
    ready.drop_right()
    assert not ready.command("lengths", wanted={"cable_length_m": [None, 1.0]})["ok"]
    ready.take_right()
    ready.obeyed("lengths", wanted={"cable_length_m": [None, 1.0]})
    ready.turn(1)
    length_m = ready.rows()["cable_length_m"][-1]
    assert math.isnan(length_m[0])
    assert length_m[1] == pytest.approx(1.0, abs=1e-3)
    try:
        moving = {"velocity_rad_s": [0.0, 4.0], "timeout_s": 2.0}
        ready.obeyed("enable", program="jog", wanted=moving)
        ready.turn_until(lambda: ready.loop.engine.program.name == "hold")
        told = ready.status
        assert (told["state"], told["program"]) == ("active", "hold")
        assert told["reason"].startswith("axis 2: cable length 1.02")
        assert told["reason"].endswith("1.020 m allowed")
        ready.turn(200)
        length_m = estimator.estimate.cable_length_m[1]
        assert 1.02 < length_m < 1.05  # the axis brakes at 1 m/s2
        back = {"velocity_rad_s": [0.0, -4.0], "timeout_s": 2.0}
        ready.obeyed("program", program="jog", wanted=back)
        ready.turn_until(lambda: estimator.estimate.cable_length_m[1] < length_m - 5e-3)
        assert ready.loop.engine.program.name == "jog"
    finally:
        estimator.forget_lengths()
        ready.obeyed("disable")


# -- tension


SENSORS = """
name = "Two load cells"
period_s = 0.02
stale_after_s = 0.5
stop_above_N = 80.0
[amplifier]
highest_N = 1000.0
[amplifier.value]
kind = "input"
address = 0
type = "int32"
scale_N = 0.01
[[sensors]]
cable = "left"
unit = 1
[[sensors]]
cable = "right"
unit = 2
"""
TIGHT = """
tension_sensors = "cells.toml"
[limits]
tension_min_N = 20.0
[limits.reactions]
slack = "controlled stop"
tension_low = "controlled stop"
"""


@pytest.fixture(scope="module")
def loaded(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[WildRig, LoadCellRig]]:
    folder = tmp_path_factory.mktemp("tight")
    (folder / "cells.toml").write_text(SENSORS)
    path = robot_file(folder, [("can0", 1), ("can0", 2)], period_s=PERIOD_S)
    top, limits = TIGHT.split("\n[limits]", 1)
    path.write_text(top + "\n" + path.read_text() + "\n[limits]" + limits)
    cells_file = folder / "cells.toml"
    with LoadCellRig(cells_file, folder, 2, lockstep=True) as cells, simulated(path) as url:
        cells.pull([30.0, 30.0])
        made = WildRig(path, url, tension_port=cells.port)
        made.boot()
        yield made, cells
        made.close()


def until_read(rig: WildRig, tension_N: float) -> None:
    """Turn until the right load cell reads `tension_N` within its error."""
    told = rig.loop.engine.parts.estimator.estimate
    rig.turn_until(lambda: abs(told.tension_N[1] - tension_N) < 2.0)


# whichever limit a falling tension reaches first
FALLEN = ("tension_low", "slack", "broken_cable")


@pytest.mark.parametrize(
    ("tension_N", "limits", "least_N", "most_N"),
    [(90.0, ("tension_high",), 80.0, 95.0), (1.0, FALLEN, -2.0, 20.0)],
)
def test_measured_tensions_end_a_motion(
    loaded: tuple[WildRig, LoadCellRig],
    tension_N: float,
    limits: tuple[str, ...],
    least_N: float,
    most_N: float,
) -> None:
    rig, cells = loaded
    until_read(rig, 30.0)
    rig.obeyed("enable", program="hold")
    rig.turn(20)
    assert rig.rows()["tension_measured"][-1].all()
    cells.pull([30.0, tension_N])
    rig.turn_until(lambda: rig.state is LoopState.FAULT and not rig.loop.busy)
    told = rig.status["reason_limit"]
    cells.pull([30.0, 30.0])
    until_read(rig, 30.0)
    rig.turn_until(lambda: bool(rig.command("acknowledge")["ok"]))
    assert told["limit"] in limits
    assert told["axis"] == 1
    assert least_N < told["value"] < most_N


def test_a_silent_load_cell_ends_the_motion_and_is_reported(
    loaded: tuple[WildRig, LoadCellRig],
) -> None:
    rig, cells = loaded
    until_read(rig, 30.0)
    rig.obeyed("enable", program="hold")
    rig.turn(20)
    cells.tell("silent 2")
    try:
        rig.turn_until(lambda: rig.state is LoopState.FAULT and not rig.loop.busy)
        told = rig.status
        assert told["reason_limit"]["limit"] == "tension_sensor"
        assert told["reason_limit"]["axis"] == 1
        answer = rig.command("acknowledge")
        assert "right: tension sensor: stale" in answer["text"]
        assert rig.state is LoopState.FAULT
    finally:
        cells.tell("mend 2")
    rig.turn_until(lambda: bool(rig.command("acknowledge")["ok"]))


# -- a single winch


def test_a_winch_runs_as_a_robot_with_one_axis() -> None:
    path = SHIPPED / "winches" / "winch-mpp0923d.toml"
    with simulated(path) as url, opened(path, url) as rig:
        assert rig.state is LoopState.READY, rig.status
        rig.obeyed("enable", program="pid", wanted={"distance_rad": [1.0]})
        rows = rig.run(2.0)
        assert rows["position_rad"][-1, 0] == pytest.approx(1.0, abs=0.1)
        assert not (rows["reaction"] > Reaction.CLAMP).any()
        rig.obeyed("disable")
        assert rig.state is LoopState.READY
