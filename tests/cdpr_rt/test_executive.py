"""The executive with a device of two free inertias (a stand-in: no bus is wanted here)."""

import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from cdpr_rt.clock import LockstepClock, PacedClock
from cdpr_rt.controllers.proportional import Proportional
from cdpr_rt.errors import InterruptedMotionError, RawLogError, TripError
from cdpr_rt.exchange import AxisCommand, AxisFeedback
from cdpr_rt.executive import Executive
from cdpr_rt.rawlog import RawLogWriter, read_raw_log
from cdpr_rt.recorder import Recorder, column_names
from cdpr_rt.supervisor import Limits, Supervisor
from cdpr_rt.trajectory import Leg

INERTIA = 1e-3
DAMPING = 0.05
LIMITS = Limits(torque_Nm=1.0, speed_rad_s=50.0, following_error_rad=2.0)


class Inertias:
    """Two damped inertias; torque written in one cycle acts from the next SYNC on."""

    def __init__(self, lockstep: bool = True) -> None:
        self.n = 2
        self.period_s = 1e-3
        self.lockstep = lockstep
        self.clock = LockstepClock() if lockstep else PacedClock()
        self.feedback = AxisFeedback(2)
        self.command = AxisCommand(2)
        self.silent: set[int] = set()
        self.alarm_at = -1
        self.speed = np.zeros(2)
        self.angle = np.zeros(2)
        self.pending = np.zeros(2)
        self.in_force = np.zeros(2)

    def sync(self) -> None:
        self.speed += self.period_s * (self.in_force - DAMPING * self.speed) / INERTIA
        self.angle += self.period_s * self.speed
        self.in_force = self.pending.copy()
        self.feedback.cycle += 1

    def receive(self) -> int:
        answers = self.feedback.cycle not in self.silent
        self.feedback.valid[:] = answers
        if answers:
            self.feedback.position_rad[:] = self.angle
        return 2 if answers else 0

    def transmit(self) -> None:
        self.pending = self.command.torque_Nm.copy()
        self.command.sent_torque_Nm[:] = self.command.torque_Nm

    def alarm(self) -> str:
        return "axis 1: told to stop" if self.feedback.cycle == self.alarm_at else ""


def executive(device: Inertias, stop: Callable[[], bool] = lambda: False) -> Executive:
    return Executive(device, Supervisor(LIMITS, 2, device.period_s), stop)


def controller() -> Proportional:
    return Proportional(np.full(2, 1.0), np.full(2, 0.5))


def leg() -> Leg:
    return Leg(np.zeros(2), np.array([1.0, -1.0]), 0.5, 0.1)


def log(path: Path) -> RawLogWriter:
    return RawLogWriter(path, column_names(2), {"axes": 2})


def test_follows_a_leg_and_records_every_cycle(tmp_path: Path) -> None:
    device = Inertias()
    writer = log(tmp_path / "a.raw")
    executive(device).run(controller(), leg(), writer)
    writer.close()
    recorded = read_raw_log(tmp_path / "a.raw")
    np.testing.assert_array_equal(recorded.column("cycle"), np.arange(1, 702))
    np.testing.assert_allclose(device.angle, [0.6, -0.6], atol=0.06)
    # what was recorded as sent is what acted: the motion can be computed from the file alone
    torque = recorded.column("torque_sent_Nm", 1)
    speed = angle = 0.0
    angles = []
    for k in range(len(torque)):
        acting = torque[k - 2] if k >= 2 else 0.0
        speed += 1e-3 * (acting - DAMPING * speed) / INERTIA
        angle += 1e-3 * speed
        angles.append(angle)
    np.testing.assert_allclose(angles, recorded.column("position_rad", 1), atol=1e-12)
    assert np.all(device.pending == 0.0)


def test_bridges_few_missing_answers_and_trips_on_more() -> None:
    device = Inertias()
    device.silent = {50, 51, 52}
    executive(device).run(controller(), leg())
    device = Inertias()
    device.silent = set(range(50, 60))
    with pytest.raises(TripError, match=r"axis 0: no feedback for 4 cycles, 3 allowed"):
        executive(device).run(controller(), leg())
    assert np.all(device.pending == 0.0)


def test_alarm_speed_and_following_error_end_the_motion_without_torque() -> None:
    device = Inertias()
    device.alarm_at = 100
    with pytest.raises(TripError, match="told to stop"):
        executive(device).run(controller(), leg())
    assert np.all(device.pending == 0.0)

    device = Inertias()
    with pytest.raises(TripError, match=r"axis 0: following error .* 114\.6 deg allowed"):
        executive(device).run(
            Proportional(np.zeros(2), np.zeros(2)), Leg(np.zeros(2), np.array([5.0, 0]), 5.0, 0.1)
        )
    device = Inertias()
    device.speed[:] = 200.0
    with pytest.raises(TripError, match=r"axis 0: speed .* 2865 deg/s allowed"):
        executive(device).run(controller(), leg())


def test_a_controller_that_fails_or_yields_nan_leaves_no_torque() -> None:
    class Broken(Proportional):
        def update(self, feedback, setpoint, torque_Nm) -> None:  # type: ignore[no-untyped-def]
            torque_Nm[:] = 0.3
            if feedback.cycle == 20:
                torque_Nm[1] = np.nan

    device = Inertias()
    with pytest.raises(TripError, match="axis 1: the controller's torque is nan"):
        executive(device).run(Broken(np.ones(2), np.ones(2)), leg())
    assert np.all(device.pending == 0.0)


def test_a_requested_stop_brakes_along_the_set_point(tmp_path: Path) -> None:
    device = Inertias()
    writer = log(tmp_path / "a.raw")
    with pytest.raises(InterruptedMotionError):
        executive(device, lambda: device.feedback.cycle >= 300).run(controller(), leg(), writer)
    writer.close()
    recorded = read_raw_log(tmp_path / "a.raw")
    velocity = recorded.column("setpoint_velocity_rad_s")
    assert velocity[298] == 1.0
    assert abs(velocity[-1]) < 1e-9
    assert np.all(np.abs(np.diff(velocity)) < 0.011)
    assert np.all(device.pending == 0.0)


def test_a_lost_bus_costs_no_row_that_was_measured(tmp_path: Path) -> None:
    class Cut(Inertias):
        def sync(self) -> None:
            super().sync()
            if self.feedback.cycle > 500:
                raise ConnectionError("the bus has gone away")

        def transmit(self) -> None:
            super().transmit()
            if self.feedback.cycle > 500:
                raise ConnectionError("the bus has gone away")

    writer = log(tmp_path / "a.raw")
    with pytest.raises(ConnectionError):
        executive(Cut()).run(controller(), leg(), writer)
    writer.close()
    assert len(read_raw_log(tmp_path / "a.raw").rows) == 500


def test_a_stop_asked_for_beforehand_begins_nothing() -> None:
    device = Inertias()
    with pytest.raises(InterruptedMotionError):
        executive(device, lambda: True).run(controller(), leg())
    with pytest.raises(InterruptedMotionError):
        executive(device, lambda: True).step(lambda: False, 1.0, "anything")
    assert device.feedback.cycle == 0


def test_a_full_disk_ends_the_motion_without_torque() -> None:
    class Full:
        def write(self, rows: np.ndarray) -> None:
            raise RawLogError("no space")

    device = Inertias()
    long_leg = Leg(np.zeros(2), np.array([0.1, 0.1]), 5.0, 0.1)
    with pytest.raises(RawLogError):
        executive(device).run(controller(), long_leg, Full())  # type: ignore[arg-type]
    assert device.feedback.cycle < 2100
    assert np.all(device.pending == 0.0)


def test_waiting_ends_by_condition_or_time_of_the_bus() -> None:
    device = Inertias()
    run = executive(device)
    run.step(lambda: device.feedback.cycle >= 30, 1.0, "the index")
    assert device.feedback.cycle == 30
    with pytest.raises(TripError, match=r"the index: not within 0\.1 s"):
        run.step(lambda: False, 0.1, "the index")
    assert device.feedback.cycle == 130


def test_paced_cycles_keep_the_period() -> None:
    device = Inertias(lockstep=False)
    run = executive(device)
    run.run(controller(), leg())
    assert run.lateness.cycles == 702  # the last one takes the torque back


def test_ring_never_overwrites() -> None:
    device = Inertias()
    recorder = Recorder(2, capacity=8)
    for _ in range(10):
        recorder.append(device.feedback, executive(device).setpoint, device.command, controller())
    assert (recorder.pending(), recorder.lost) == (8, 2)
    recorder.clear()
    assert recorder.pending() == 0


def test_a_cycle_that_is_held_up_is_counted_and_makes_none_run_in_a_hurry() -> None:
    class HeldUp(Inertias):
        def __init__(self) -> None:
            super().__init__(lockstep=False)
            self.syncs: list[float] = []

        def sync(self) -> None:
            super().sync()
            self.syncs.append(time.monotonic())

        def receive(self) -> int:
            if self.feedback.cycle == 50:
                time.sleep(0.05)
            return super().receive()

    device = HeldUp()
    run = executive(device)
    run.step(lambda: device.feedback.cycle >= 100, 1.0, "some cycles")
    assert run.lateness.worst_s > 0.04
    # the cycle after it begins late, those that follow a period after each other
    apart = np.diff(device.syncs)[50:]
    assert np.sum(apart < 0.5 * device.period_s) == 0
    late = run.lateness.late
    time.sleep(0.05)
    run.step(lambda: device.feedback.cycle >= 101, 1.0, "one cycle")
    assert run.lateness.late <= late  # a pause between motions is nobody's fault
