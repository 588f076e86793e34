"""Program `track`: run a given controller along a given motion, for procedures."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from cdpr_rt.arrays import FloatArray
from cdpr_rt.control.base import Controller, Idle
from cdpr_rt.core.exchange import AxisFeedback, Setpoint
from cdpr_rt.motion.trajectory import Motion
from cdpr_rt.programs.base import Program, ProgramError


class TrackProgram(Program):
    """Runs the controller and motion given to `take`; a stop follows the motion's braking ramp.

    The controller is reset at the start; the last program's torque is not carried over.
    """

    name = "track"
    needs_lease = False
    at_rest = True
    """Whether the motion's last cycle has been run."""

    def __init__(self, n: int, period_s: float) -> None:
        self.controller: Controller = Idle(n)
        self._motion: Motion | None = None
        self._period_s = period_s
        self._cycle = self._last = 0
        self._stopping = False

    def take(self, controller: Controller, motion: Motion) -> None:
        """Run `controller` along `motion` from the next start on."""
        self.controller, self._motion = controller, motion

    def start(self, _feedback: AxisFeedback, _setpoint: Setpoint, _torque_Nm: FloatArray) -> None:
        """Begin the motion; raises ProgramError if none was given."""
        if self._motion is None:
            raise ProgramError(
                f"{self.name}: only a procedure can start it, because it needs a motion"
            )
        self.controller.reset()
        self._cycle, self._last = 0, round(self._motion.duration_s / self._period_s)
        self.at_rest = self._stopping = False

    def check(self, _arguments: Mapping[str, Any]) -> Any:
        """Raise ProgramError, because commands cannot start this program."""
        raise ProgramError(f"{self.name}: only a procedure can start it, because it needs a motion")

    def update(self, feedback: AxisFeedback, setpoint: Setpoint, torque_Nm: FloatArray) -> None:
        """Write this cycle's set-point and torques, (n,) each, in place."""
        motion = self._motion
        assert motion is not None  # the program has been started
        motion.fill(self._cycle * self._period_s, setpoint)
        self.controller.update(feedback, setpoint, torque_Nm)
        self._cycle += 1
        self.at_rest = self._cycle > self._last

    def stop(self) -> None:
        """Continue with the braking motion from its middle, at which its ramp-up would end."""
        if self._stopping or self._motion is None:
            return
        self._stopping = True
        self._motion = motion = self._motion.brake((self._cycle - 1) * self._period_s)
        self._cycle = round(0.5 * motion.duration_s / self._period_s) + 1
        self._last = round(motion.duration_s / self._period_s)

    @property
    def rest_s(self) -> float:
        """Return the remaining duration of the motion."""
        return (self._last - self._cycle + 1) * self._period_s

    def progress(self) -> dict[str, Any]:
        """Return the elapsed and the total time of the motion."""
        done_s, whole_s = (cycles * self._period_s for cycles in (self._cycle, self._last))
        return {"time_s": done_s, "duration_s": whole_s}
