"""A procedure's motions in the loop: how they run, are recorded and end."""

from __future__ import annotations

import time
from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest

from cdpr_profiles.robot_limits import Limit
from cdpr_rt.arrays import FloatArray
from cdpr_rt.control.pid import Proportional
from cdpr_rt.core.exchange import AxisFeedback, Setpoint
from cdpr_rt.core.fault import Fault
from cdpr_rt.core.states import LoopState
from cdpr_rt.errors import InterruptedMotionError, RawLogError, TripError
from cdpr_rt.identification.rawlog import read_raw_log
from cdpr_rt.motion.trajectory import Hold, TrapezoidalMove
from tests.cdpr_rt.loop.operating_rig import (
    DAMPING,
    INERTIA,
    Inertias,
    controller,
    leg,
    log,
    powered,
)


class WatchWithFault:
    """A watch that reports a fault from a cycle of the device on."""

    def __init__(self, device: Inertias, alarm: str = "", stop: str = "") -> None:
        self.device, self.cycle, self.texts = device, 10**9, (alarm, stop)

    def fault(self) -> Fault | None:
        if self.device.feedback.cycle < self.cycle:
            return None
        alarm, stop = self.texts
        limit = Limit.SAFETY_ALARM if alarm else Limit.SAFETY_STOP
        return Fault(limit, detail=alarm or stop)


def test_a_leg_is_followed_and_every_cycle_recorded(tmp_path: Path) -> None:
    writer = log(tmp_path / "a.raw")
    with powered() as rig:
        rig.follow(log=writer)
        began, device = rig.began, rig.device
    writer.close()
    recorded = read_raw_log(tmp_path / "a.raw")
    np.testing.assert_array_equal(recorded.column("cycle") - began, np.arange(1, 702))
    np.testing.assert_allclose(device.angle, [0.6, -0.6], atol=0.06)
    # the recorded torque acted: the motion can be computed from the file alone
    torque = recorded.column("torque_sent_Nm", 1)
    speed = angle = 0.0
    angles = []
    for k in range(len(torque)):
        acting = torque[k - 2] if k >= 2 else 0.0
        speed += 1e-3 * (acting - DAMPING * speed) / INERTIA
        angle += 1e-3 * speed
        angles.append(angle)
    np.testing.assert_allclose(angles, recorded.column("position_rad", 1), atol=1e-12)
    assert recorded.column("effort_Nm", 1).any()
    assert np.all(device.pending == 0.0)


def test_a_motion_longer_than_the_ring_loses_no_row(tmp_path: Path) -> None:
    writer, told = log(tmp_path / "a.raw"), []
    with powered() as rig:
        assert rig.block.capacity == 256
        motion = TrapezoidalMove(np.zeros(2), np.array([0.1, 0.1]), 9.0, 0.1)
        rig.operator.follow(controller(), motion, writer, told.append)
    writer.close()
    np.testing.assert_array_equal(
        np.diff(read_raw_log(tmp_path / "a.raw").column("cycle")), np.ones(9200)
    )
    assert told == pytest.approx(0.128 * np.arange(1, 72))


def test_no_torque_remains_between_two_motions() -> None:
    with powered() as rig:
        for _ in range(2):
            start = rig.device.angle.copy()
            rig.follow(TrapezoidalMove(start, np.array([1.0, -1.0]), 0.5, 0.1))
            assert not rig.device.pending.any()
        rig.operator.disable()
        assert not rig.machine.power
        rig.operator.enable()
        assert rig.machine.power


def test_three_missing_answers_are_tolerated_and_more_trip() -> None:
    with powered() as rig:
        rig.device.silent = {rig.began + k for k in (50, 51, 52)}
        rig.follow()
    with powered() as rig:
        rig.device.silent = {rig.began + k for k in range(50, 60)}
        with pytest.raises(TripError, match=r"axis 1: no feedback for 4 cycles, 3 allowed"):
            rig.follow()
        assert np.all(rig.device.pending == 0.0)
        assert not rig.machine.power


def test_alarm_speed_and_following_error_trip_the_motion() -> None:
    with powered() as rig:
        rig.device.alarm_at = rig.began + 100
        with pytest.raises(TripError, match="told to stop"):
            rig.follow()
        assert np.all(rig.device.pending == 0.0)
        assert not rig.machine.power
    with (
        powered() as rig,
        pytest.raises(TripError, match=r"axis 1: following error .* 114\.6 deg allowed"),
    ):
        rig.follow(
            TrapezoidalMove(np.zeros(2), np.array([5.0, 0]), 5.0, 0.1),
            Proportional(np.zeros(2), np.zeros(2)),
        )
    with powered() as rig:
        rig.device.speed[:] = 200.0
        with pytest.raises(TripError, match=r"axis 1: speed .* 2865 deg/s allowed"):
            rig.follow()


def test_a_motion_can_be_repeated_after_its_fault_is_acknowledged(tmp_path: Path) -> None:
    with powered() as rig:
        rig.device.alarm_at = rig.began + 100
        with pytest.raises(TripError):
            rig.follow()
        assert rig.loop.life.state is LoopState.FAULT
        with pytest.raises(TripError, match="told to stop"):
            rig.operator.idle(0.1)
        rig.operator.reset()
        rig.operator.idle(0.5)
        rig.operator.enable()
        writer = log(tmp_path / "b.raw")
        rig.follow(
            TrapezoidalMove(rig.device.angle.copy(), np.array([1.0, -1.0]), 0.5, 0.1), log=writer
        )
        writer.close()
    assert len(read_raw_log(tmp_path / "b.raw").rows) == 701


@pytest.mark.parametrize("mistake", ["nan", "error"])
def test_a_controller_that_fails_or_yields_nan_leaves_no_torque(mistake: str) -> None:
    class Broken(Proportional):
        def update(self, feedback, setpoint, torque_Nm) -> None:  # type: ignore[no-untyped-def]
            torque_Nm[:] = 0.3
            if rig.cycle == 20:
                torque_Nm[1] = np.nan
                if mistake == "error":
                    raise ZeroDivisionError("by nought")

    told = "torque is nan" if mistake == "nan" else "program track: ZeroDivisionError: by nought"
    with powered() as rig:
        with pytest.raises(TripError, match=told):
            rig.follow(by=Broken(np.ones(2), np.ones(2)))
        assert rig.cycle < 40
        assert np.all(rig.device.pending == 0.0)


def test_a_requested_stop_brakes_along_the_set_point(tmp_path: Path) -> None:
    writer = log(tmp_path / "a.raw")
    with powered() as rig:
        rig.stop = lambda: rig.cycle >= 300
        with pytest.raises(InterruptedMotionError):
            rig.follow(log=writer)
        assert np.all(rig.device.pending == 0.0)
    writer.close()
    velocity = read_raw_log(tmp_path / "a.raw").column("setpoint_velocity_rad_s")
    assert velocity[298] == 1.0
    assert abs(velocity[-1]) < 1e-9
    assert np.all(np.abs(np.diff(velocity)) < 0.011)


def test_a_lost_bus_loses_no_measured_row(tmp_path: Path) -> None:
    class Cut(Inertias):
        last = 10**9

        def sync(self) -> None:
            super().sync()
            if self.feedback.cycle > self.last:
                raise ConnectionError("the bus is lost")

        def transmit(self, and_sync: bool = False) -> None:
            super().transmit(and_sync)
            if self.feedback.cycle > self.last:
                raise ConnectionError("the bus is lost")

    device, writer = Cut(), log(tmp_path / "a.raw")
    with powered(device) as rig:
        device.last = rig.began + 500
        with pytest.raises(TripError, match="the bus is lost"):
            rig.follow(log=writer)
    writer.close()
    assert len(read_raw_log(tmp_path / "a.raw").rows) == 500


def test_an_earlier_stop_request_prevents_any_motion() -> None:
    with powered() as rig:
        rig.stop = lambda: True
        with pytest.raises(InterruptedMotionError):
            rig.follow()
        with pytest.raises(InterruptedMotionError, match="before anything"):
            rig.operator.wait(lambda: False, 1.0, "anything")
        assert rig.cycle == 0
        rig.operator.disable()  # a procedure always ends with this
        assert not rig.machine.power
        with pytest.raises(InterruptedMotionError):
            rig.operator.enable()


def test_a_full_disk_ends_the_motion_without_torque() -> None:
    class Full:
        def write(self, rows: np.ndarray) -> None:
            raise RawLogError("no space")

    with powered() as rig:
        with pytest.raises(RawLogError):
            rig.follow(TrapezoidalMove(np.zeros(2), np.array([0.1, 0.1]), 5.0, 0.1), log=Full())
        assert rig.cycle < 2100
        rig.loop.turn()
        assert np.all(rig.device.pending == 0.0)


def test_a_motion_ends_in_the_cycle_of_its_condition() -> None:
    with powered() as rig:
        rig.operator.follow(controller(), leg(), until=lambda: rig.cycle == 30)
        assert rig.cycle == 31  # one more cycle takes the torque away
        assert not rig.device.pending.any()


def test_waiting_ends_by_its_condition_or_after_its_time_in_cycles() -> None:
    with powered() as rig:
        rig.operator.wait(lambda: rig.cycle >= 30, 1.0, "the index")
        assert rig.cycle == 30
        with pytest.raises(TripError, match=r"the index: not complete after 0\.1 s"):
            rig.operator.wait(lambda: False, 0.1, "the index")
        assert rig.cycle == 130


def test_positions_are_not_supervised_while_drives_move_their_motors() -> None:
    with powered() as rig:
        rig.operator.disable()

        def jump() -> bool:
            if rig.machine.power:
                rig.device.angle += 1.0
            return bool(rig.device.angle[0] > 5.0)

        rig.operator.let_drive(jump, 1.0, "homing")
        assert not rig.machine.power
        assert rig.loop.life.state is LoopState.READY


def test_a_background_task_does_not_delay_cycles() -> None:
    with powered() as rig:
        clock = rig.loop.engine.machine.clock

        def work() -> int:
            clock.wait(lambda: rig.cycle >= 40)
            return 7

        assert rig.operator.run_task(work) == 7
        assert rig.cycle == pytest.approx(41, abs=1)
        rig.device.alarm_at = rig.device.feedback.cycle + 10
        with pytest.raises(TripError, match="told to stop"):
            rig.operator.run_task(lambda: clock.wait(lambda: False))
        assert not rig.loop.runner.task_running


# -- alarms and stops from outside the axes


def test_an_alarm_takes_the_torque_in_the_same_cycle() -> None:
    device = Inertias()
    quiet, loud = WatchWithFault(device, "never"), WatchWithFault(device, "input 0 reads 0")
    with powered(device, quiet, loud) as rig:
        loud.cycle = rig.began + 200
        speeds = []
        with pytest.raises(TripError, match="input 0 reads 0"):
            rig.operator.follow(
                controller(), leg(), until=lambda: bool(speeds.append(device.speed[0]))
            )
        assert len(speeds) == 200
        assert not device.pending.any()
        assert speeds[-1] > 0.5  # without braking


def test_a_stop_by_a_watch_brakes_before_torque_is_removed(tmp_path: Path) -> None:
    device, writer = Inertias(), log(tmp_path / "a.raw")
    watch = WatchWithFault(device, stop="no good poll")
    with powered(device, watch) as rig:
        watch.cycle = rig.began + 200
        with pytest.raises(TripError, match="no good poll"):
            rig.follow(log=writer)
        assert not device.pending.any()
        assert not rig.machine.power
    writer.close()
    # the ramp takes 0.1 s
    velocity = read_raw_log(tmp_path / "a.raw").column("setpoint_velocity_rad_s")
    assert len(velocity) == 200 + 100
    assert abs(velocity[-1]) < 0.05


def test_braking_may_take_several_seconds(tmp_path: Path) -> None:
    """For example a mass that is lowered to where it hung."""

    class Slow(TrapezoidalMove):
        def brake(self, time_s: float) -> TrapezoidalMove:
            self.fill(time_s, now := Setpoint(2))
            return Hold(now.position_rad, 14.0)

    device, writer = Inertias(), log(tmp_path / "a.raw")
    watch = WatchWithFault(device, stop="no good poll")
    with powered(device, watch) as rig:
        watch.cycle = rig.began + 200
        with pytest.raises(TripError, match="no good poll"):
            rig.follow(Slow(np.zeros(2), np.array([1.0, -1.0]), 0.5, 0.1), log=writer)
    writer.close()
    assert len(read_raw_log(tmp_path / "a.raw").rows) == 200 + 7000


def test_a_watch_also_ends_waiting() -> None:
    device = Inertias()
    watch = WatchWithFault(device, stop="no good poll")
    with powered(device, watch) as rig:
        watch.cycle = rig.began + 20
        with pytest.raises(TripError, match="no good poll"):
            rig.operator.wait(lambda: False, 1.0, "waiting")
        assert not rig.machine.power


# -- time


def test_paced_cycles_keep_the_period() -> None:
    with powered(Inertias(lockstep=False)) as rig:
        before = rig.operator.lateness.cycles
        rig.follow()
        assert rig.operator.lateness.cycles - before == 702  # the last one takes the torque away


def test_a_delayed_cycle_is_counted_and_later_cycles_keep_their_period() -> None:
    class HeldUp(Inertias):
        at = 10**9
        held = 0
        """The SYNC whose cycle is held up."""

        def __init__(self) -> None:
            super().__init__(lockstep=False)
            self.syncs: list[float] = []

        def sync(self) -> None:
            super().sync()
            self.syncs.append(time.monotonic())

        def receive(self) -> int:
            if self.feedback.cycle == self.at:
                self.held = len(self.syncs) - 1
                time.sleep(0.05)
            return super().receive()

    device = HeldUp()
    with powered(device) as rig:
        device.at = rig.began + 50
        rig.operator.wait(lambda: rig.cycle >= 100, 60.0, "some cycles")
        assert rig.operator.lateness.worst_s > 0.04
        # the next cycle begins late; it and those that follow take their full period
        syncs = device.syncs[device.held :]
        assert syncs[-1] - syncs[0] > 0.05 + (len(syncs) - 3) * device.period_s


def test_a_torque_computed_from_old_answers_is_not_sent() -> None:
    class Sends(Inertias):
        def __init__(self) -> None:
            super().__init__(lockstep=False)
            self.sent: dict[int, float] = {}

        def transmit(self, and_sync: bool = False) -> None:
            super().transmit(and_sync)
            self.sent[self.feedback.cycle] = float(self.command.torque_Nm[0])

    class Stopped(Proportional):
        """Its process stands still in one cycle, as after SIGSTOP."""

        at = 0

        def update(self, feedback: AxisFeedback, setpoint: Setpoint, torque_Nm: FloatArray) -> None:
            torque_Nm[:] = 0.01
            if feedback.cycle == self.at:
                time.sleep(0.15)

    device = Sends()
    with powered(device) as rig:
        stopped = Stopped(np.zeros(2), np.zeros(2))
        stopped.at = rig.began + 30
        with suppress(TripError):  # the cycle is late
            rig.follow(by=stopped)
    assert [device.sent[stopped.at - k] for k in (2, 1, 0)] == [0.01, 0.01, 0.0]
