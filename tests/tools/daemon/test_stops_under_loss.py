"""A quick stop completes although answers or a whole bus are lost meanwhile."""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np

from cdpr_drivers.cia402 import POWER_OFF, State, state_of
from cdpr_rt.core.states import LoopState
from tests.drivers.bus_log import BusLog, logged
from tests.tools.daemon.loop_rig import LoopRig, opened
from tests.tools.robot_rig import Simulator, robot_file, simulated, unique

PERIOD_S = 2e-3
DROP_TPDOS = 2
JOG = {"velocity_rad_s": [20.0, 20.0], "timeout_s": 2.0}


def jog(rig: LoopRig) -> None:
    rig.obeyed("enable", program="jog", wanted=JOG)
    rig.run(0.8)
    assert np.all(rig.loop.engine.parts.estimator.estimate.velocity_rad_s > 15.0)
    rig.rows()


def expect_no_coasting(log: BusLog, node: int) -> None:
    """Check that power was cut only after the drive reported the end of braking."""
    said, told = State.OPERATION_ENABLED, set()
    for frame in log.frames:
        if frame.identifier == 0x180 + node:
            said = state_of(struct.unpack_from("<H", frame.data)[0])
        if frame.identifier == 0x200 + node and said not in POWER_OFF:
            told.add(struct.unpack_from("<H", frame.data)[0] & 0x0F)
    assert told == {0x0F, 0x02}


def test_a_quick_stop_completes_after_the_loss_of_one_of_two_buses(tmp_path: Path) -> None:
    axes = [("can0", 1), ("can1", 1)]
    path = robot_file(tmp_path, axes, period_s=PERIOD_S)
    names = [unique(), unique()]
    lost, left = (Simulator("winch-mpp0923d", "--bus", f"simbus:{name}") for name in names)
    try:
        urls = " ".join(f"can{i}=simbus:{name}" for i, name in enumerate(names))
        with opened(path, urls) as rig:
            jog(rig)
            with logged(f"simbus:{names[1]}") as log:
                rig.turn(10)
                rig.rows()
                lost.kill()
                rig.turn_until(lambda: rig.state is LoopState.FAULT)
            rows = rig.rows()
            rig.turn_until(lambda: not rig.loop.busy)
            assert "axis 1: may still have power" in rig.status["reason"]
        expect_no_coasting(log, 1)
        assert rows["valid"][:, 1].all()  # its answers were received
        assert not rows["alive"][-1, 0]
    finally:
        lost.close()
        left.close()


def test_a_quick_stop_completes_while_answers_are_missing(tmp_path: Path) -> None:
    axes = [("can0", 1), ("can0", 2)]
    path = robot_file(tmp_path, axes, period_s=PERIOD_S)
    # waiting for answers takes most of the half second that a bus holds its time
    with simulated(path) as url, opened(path, url) as rig:
        jog(rig)
        (bus,) = rig.machine._urls.values()
        with logged(str(bus)) as log:
            rig.turn(10)
            for axis in (0, 1):
                rig.inject_fault(axis, DROP_TPDOS, 20)
                rig.turn(1)
            rig.turn_until(lambda: rig.state is LoopState.FAULT)
        for node in (1, 2):
            expect_no_coasting(log, node)
