"""What the executive does when something beside the axes asks for an end."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))
from test_executive import LIMITS, Inertias, controller, leg

from cdpr_rt.errors import TripError
from cdpr_rt.executive import Executive
from cdpr_rt.supervisor import Supervisor


class At:
    """A watch that speaks up from a cycle on."""

    def __init__(self, device: Inertias, cycle: int, alarm: str = "", stop: str = "") -> None:
        self.device, self.cycle, self.texts = device, cycle, (alarm, stop)

    def alarm(self) -> str:
        return self.texts[0] if self.device.feedback.cycle >= self.cycle else ""

    def stop_reason(self) -> str:
        return self.texts[1] if self.device.feedback.cycle >= self.cycle else ""


def executive(device: Inertias, *watches: At) -> Executive:
    return Executive(device, Supervisor(LIMITS, 2, device.period_s), lambda: False, watches)


def test_an_alarm_takes_the_torque_in_the_same_cycle() -> None:
    device = Inertias()
    quiet, loud = At(device, 10**9, "never"), At(device, 200, "input 0 reads 0")
    with pytest.raises(TripError, match="input 0 reads 0"):
        executive(device, quiet, loud).run(controller(), leg())
    assert device.feedback.cycle == 200
    assert not device.pending.any()
    assert device.speed[0] > 0.5  # nothing has braked it


def test_a_reason_to_stop_brakes_the_motion_first() -> None:
    device = Inertias()
    run = executive(device, At(device, 200, stop="no good poll"))
    with pytest.raises(TripError, match="no good poll"):
        run.run(controller(), leg())
    # the ramp takes 0.1 s, and one cycle more takes the torque back
    assert device.feedback.cycle == 200 + 100 + 1
    assert abs(run.setpoint.velocity_rad_s[0]) < 0.05
    assert not device.pending.any()


def test_a_watch_ends_a_procedure_of_the_device_as_well() -> None:
    device = Inertias()
    with pytest.raises(TripError, match="no good poll"):
        executive(device, At(device, 20, stop="no good poll")).step(lambda: False, 1.0, "waiting")
    assert device.feedback.cycle == 20
