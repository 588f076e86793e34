"""The encoder index of a simulated drive is found by homing and by touch probe."""

from __future__ import annotations

import math

import pytest

from cdpr_drivers.axes import homing as touch_probe
from cdpr_drivers.axes.homing import MIRRORED, Homing, HomingStep
from cdpr_drivers.cia402 import Mode, State
from cdpr_drivers.errors import DriveFaultError
from cdpr_sim_bus.cia402.modes import METHODS
from tests.drivers.axis_rig import DRIVE, Rig, open_rig

COUNT_RAD = math.tau / 8192


def _home(rig: Rig, method: int, timeout_s: float = 30.0) -> Homing:
    homing = Homing(rig.group, 0, method, timeout_s)
    homing.configure()
    rig.enable(Mode.HOMING)
    rig.run(40.0, homing.update)
    rig.reach(State.SWITCH_ON_DISABLED)
    return homing


def _turn(rig: Rig, torque_Nm: float, seconds: float = 3.0) -> None:
    """Turn the motor with the given torque until its index is known."""
    feedback = rig.group.feedback
    rig.enable(Mode.CYCLIC_TORQUE)
    rig.group.command.torque_Nm[0] = torque_Nm
    rig.run(seconds, lambda: bool(feedback.index_known[0]))
    rig.group.command.torque_Nm[0] = 0.0
    rig.reach(State.SWITCH_ON_DISABLED)
    assert feedback.index_known[0]


def _turns_apart(a_rad: float, b_rad: float) -> float:
    return abs(math.remainder(a_rad - b_rad, math.tau))


def test_the_probe_finds_the_same_index_in_both_directions(rig: Rig) -> None:
    found = []
    for torque_Nm in (0.25, -0.25, 0.25):
        touch_probe.arm(rig.group, 0)
        assert not rig.group.feedback.index_known[0]
        _turn(rig, torque_Nm)
        found.append(float(rig.group.feedback.index_rad[0]))
    assert _turns_apart(found[0], found[1]) <= COUNT_RAD
    assert _turns_apart(found[0], found[2]) <= COUNT_RAD


@pytest.mark.parametrize("method", METHODS)
def test_the_mirrored_homing_method_moves_in_opposite_directions(method: int) -> None:
    assert METHODS[MIRRORED[method]] == METHODS[method].mirrored()
    if method < 15:  # the same method without index
        assert MIRRORED[method + 16] == MIRRORED[method] + 16


def test_homing_in_place_does_not_find_the_index(rig: Rig) -> None:
    assert _home(rig, 37).step is HomingStep.DONE
    assert not rig.group.feedback.index_known[0]


def test_a_second_homing_moves_although_the_drive_is_already_homed(rig: Rig) -> None:
    _home(rig, 37)
    homing = Homing(rig.group, 0, 34)
    homing.configure()
    rig.enable(Mode.HOMING)
    begin = rig.group.feedback.time_s
    rig.run(40.0, homing.update)
    assert homing.step is HomingStep.DONE
    assert rig.group.feedback.time_s - begin > 0.1  # the motor had to move
    assert rig.group.feedback.index_known[0]


def test_a_homing_method_missing_in_the_profile_is_rejected(rig: Rig) -> None:
    with pytest.raises(DriveFaultError, match="homing method 19 is not supported"):
        Homing(rig.group, 0, 19)


def test_homing_that_takes_too_long_is_halted(rig: Rig) -> None:
    homing = Homing(rig.group, 0, 34, timeout_s=0.3)
    homing.configure()
    rig.enable(Mode.HOMING)
    with pytest.raises(DriveFaultError, match=r"not done within 0\.3 s"):
        rig.run(2.0, homing.update)
    assert homing.step is HomingStep.FAILED
    rig.run(1.0)
    still = rig.group.feedback.position_rad[0]
    rig.run(1.0)
    assert rig.group.feedback.position_rad[0] == pytest.approx(still, abs=0.01)
    assert not rig.group.feedback.index_known[0]
    rig.reach(State.SWITCH_ON_DISABLED)


def test_arming_a_probe_that_is_not_in_a_pdo_is_an_error(bus: str) -> None:
    drive = DRIVE.model_copy(update={"tpdos": DRIVE.tpdos[:1]})
    with open_rig(bus, drive=drive) as rig, pytest.raises(DriveFaultError, match="60B9h"):
        touch_probe.arm(rig.group, 0)
