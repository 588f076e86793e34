"""The cyclic executive: the one loop in which every controller runs."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Protocol

from cdpr_rt.controllers.base import Controller, Idle
from cdpr_rt.cycle import Cycle, Lateness, Watch
from cdpr_rt.errors import InterruptedMotionError, NotInTimeError, TripError
from cdpr_rt.exchange import AxisDevice, Setpoint
from cdpr_rt.rawlog import RawLogWriter
from cdpr_rt.recorder import Recorder
from cdpr_rt.runtime.estimate import Estimator
from cdpr_rt.runtime.states import Reaction
from cdpr_rt.supervisor import Supervisor

__all__ = ["Executive", "Lateness", "Motion", "Watch"]

_DRAIN_ROWS = 2048


class Motion(Protocol):
    """A set-point over time, such as a `Leg`."""

    duration_s: float

    def fill(self, time_s: float, setpoint: Setpoint) -> None:
        """Write the set-point at `time_s` after the start."""

    def brake(self, time_s: float) -> Motion:
        """Return the motion that stops from the state at `time_s`."""


class Executive:
    """Runs controllers on a device, one cycle after the other.

    On a lockstep device the next SYNC goes out as soon as a cycle is done; otherwise each SYNC
    has an absolute deadline. `stop_requested` and `watches` are looked at once a cycle: what a
    request or a watch's `stop_reason` ends, it ends by a braking set-point under the same
    controller; a watch's `alarm` takes the torque at once.
    """

    def __init__(
        self,
        device: AxisDevice,
        supervisor: Supervisor,
        stop_requested: Callable[[], bool],
        watches: Sequence[Watch] = (),
    ) -> None:
        self.device = device
        self.supervisor = supervisor
        self.estimator = Estimator(device.n, device.period_s)
        self.setpoint = Setpoint(device.n)
        self.on_progress: Callable[[float], None] | None = None
        """Called every few thousand cycles with the time since the motion's start."""
        self._recorder = Recorder(device.n)
        self._log: RawLogWriter | None = None
        self._stop_requested = stop_requested
        self._cycle = Cycle(device, watches)
        self._idle = Idle(device.n)

    @property
    def lateness(self) -> Lateness:
        """How the deadlines were kept."""
        return self._cycle.lateness

    def run(self, controller: Controller, motion: Motion, log: RawLogWriter | None = None) -> None:
        """Run `controller` along `motion` to its end, recording into `log`.

        However it ends, the last torque sent is zero and what was recorded is in the file.
        Raises TripError when the supervisor, the device or a watch ends the motion, and
        InterruptedMotionError after a requested stop.
        """
        self._refuse_when_stopped("the motion")
        controller.reset()
        self.supervisor.reset()
        self.estimator.reset()
        self._recorder.clear()
        self._log = log
        self._cycle.begin()
        try:
            self._follow(controller, motion)
        finally:
            try:
                self._cycle.release()
            finally:  # a bus that is gone takes no zero torque, yet the rows are to be kept
                self._drain()
                self._log = None

    def step(self, each_cycle: Callable[[], bool], timeout_s: float, what: str) -> None:
        """Run cycles without torque, calling `each_cycle` after each exchange, until it is true.

        A device's own procedure (homing, enabling) advances by its `each_cycle`. Raises
        NotInTimeError after `timeout_s` of bus time, TripError when the device or a watch ends it,
        and InterruptedMotionError on request.
        """
        self._refuse_when_stopped(what)
        self._cycle.begin()
        period = self.device.period_s
        for _ in range(max(1, round(timeout_s / period))):
            self._cycle.exchange()
            self._look_for_alarm()
            reason = self._cycle.stop_reason()
            if reason:
                self._trip(reason)
            self.setpoint.position_rad[:] = self.device.feedback.position_rad
            self._idle.update(self.device.feedback, self.setpoint, self.device.command.torque_Nm)
            done = each_cycle()
            self._cycle.transmit()
            self.device.clock.turn()
            if done:
                return
            self._refuse_when_stopped(what)
        raise NotInTimeError(f"{what}: not within {timeout_s:g} s")

    def _refuse_when_stopped(self, what: str) -> None:
        if self._stop_requested():
            raise InterruptedMotionError(f"stopped on request before {what}")

    def _follow(self, controller: Controller, motion: Motion) -> None:
        device, setpoint, recorder = self.device, self.setpoint, self._recorder
        estimator = self.estimator
        feedback, command = device.feedback, device.command
        period = device.period_s
        cycles = round(motion.duration_s / period)
        stopping, why = False, ""
        k = 0
        while k <= cycles:
            self._cycle.exchange()
            self._look_for_alarm()
            motion.fill(k * period, setpoint)
            controller.update(feedback, setpoint, command.torque_Nm)
            estimator.update(feedback, elapsed_s=self._cycle.elapsed_s)
            supervisor = self.supervisor
            supervisor.check(feedback, estimator.estimate, setpoint, command.torque_Nm)
            if supervisor.reaction > Reaction.CLAMP:
                self._trip(supervisor.reason())
            self._cycle.transmit()
            recorder.append(feedback, setpoint, command, controller)
            device.clock.turn()
            if recorder.pending() >= _DRAIN_ROWS:
                self._drain()
                if self.on_progress is not None:
                    self.on_progress(k * period)
            if not stopping:
                why = self._cycle.stop_reason()
                stopping = bool(why) or self._stop_requested()
                if stopping:
                    motion = motion.brake(k * period)
                    # the braking motion is entered where its ramp-up would end
                    k = round(0.5 * motion.duration_s / period)
                    cycles = round(motion.duration_s / period)
            k += 1
        if why:
            raise TripError(why)
        if stopping:
            raise InterruptedMotionError("stopped on request")

    def _look_for_alarm(self) -> None:
        alarm = self._cycle.device_alarm() or self._cycle.watch_alarm()
        if alarm:
            self._trip(alarm)

    def _trip(self, reason: str) -> None:
        self._cycle.release()
        raise TripError(reason)

    def _drain(self) -> None:
        if self._log is None:
            self._recorder.clear()
        else:
            self._recorder.drain(self._log)
