"""Safe stop: controlled braking, lowering, quick stop, or torque off."""

from __future__ import annotations

import traceback
from collections.abc import Sequence
from contextlib import suppress
from enum import Enum, auto
from typing import Final

import numpy as np

from cdpr_profiles.robot_limits import Limit
from cdpr_rt.arrays import FloatArray
from cdpr_rt.core.fault import IN_DRIVES_FAULT, IN_REASON, OR_LANDED, PROGRAM, Fault
from cdpr_rt.core.states import LoopState, Reaction
from cdpr_rt.core.supervisor import LENGTHS_UNRELIABLE, POSE_UNRELIABLE
from cdpr_rt.errors import ControlError
from cdpr_rt.loop.engine import HOLD, IDLE, Engine, Steps, TransitionRunner

_SETTLE_S: Final = 1.0
_STILL_RAD_S: Final = 0.3
_BRAKES_S: Final = 2.0
_POWER_OFF_S: Final = 3.0
_POWER_OFF_AT_LAST_S: Final = 0.5


class StopMethod(Enum):
    """Method to end a motion."""

    BRAKE = auto()
    """The program brakes, then holds the axes or lowers the platform."""
    LOWER_WITHOUT_POSE = auto()
    """The winches that still work lower the platform, without using the pose."""
    QUICK_STOP = auto()
    """The drives make their own quick stop."""
    TORQUE_OFF = auto()
    """The torque is removed immediately."""


class SafeStop:
    """Ends motions according to the fault, then removes the drives' power.

    - Axes without a platform, or with brakes: braked under their program, held by the brakes.
    - A platform of known pose: returned home and lowered by the program of `Lowering`, which lowers
      it in place if cables are slack.
    - A drive lost, or a limit of `POSE_UNRELIABLE` exceeded: a platform is lowered without using
      its pose; axes without a platform make a quick stop.
    - The code of a program fails: as with a known pose; if it fails again, without the pose.
    - A failure of any of these: quick stop.
    """

    def __init__(self, engine: Engine, runner: TransitionRunner) -> None:
        self._engine = engine
        self._runner = runner
        self._machine, self._life = engine.machine, engine.life
        self._supervisor, self._estimator = engine.parts.supervisor, engine.parts.estimator
        self._lowering = engine.parts.lowering
        self.without_pose = False
        """Whether the platform is being lowered without using its pose."""
        self._highest_N: dict[int, float] = {}
        """Highest tension of each axis that exceeded its limit during the present reaction."""

    @property
    def lowers(self) -> bool:
        """Whether a platform is lowered before power-off, because no brakes would hold it."""
        return self._lowering is not None and not self._machine.has_brakes

    @property
    def pays_out_blind(self) -> bool:
        """Whether the winches are lowering a platform without using its pose."""
        lowering, slack = self._lowering, self._estimator.estimate.slack_allowed
        return lowering is not None and slack and self._engine.program.name == lowering.program

    @property
    def reacts_to_fault(self) -> bool:
        """Whether a motion is being ended under control because of a fault."""
        engine = self._engine
        return engine.driving and engine.reacting > Reaction.HOLD and self._life.ends_motion

    # -- ending a motion

    def note_further(self, drives: Sequence[Fault]) -> None:
        """Add faults during the reaction to a fault; `drives` are faults of drives.

        Each drive is added once, and missed answers are part of its fault. Consequences for an axis
        that has failed, such as its speed, are not added. A tension above its limit is always
        added, with the highest value, and so is a cable that breaks because of it.
        """
        life = self._life
        failed = [(fault.limit, fault.axis) for fault in life.faults.values()]
        for fault in drives:
            explains = any(map(fault.explains, life.faults.values()))
            if explains or fault.axis < 0 or (fault.limit, fault.axis) not in failed:
                life.add_fault(fault)
        for fault in self._supervisor.findings():
            limit, axis = fault.limit, fault.axis
            if limit is Limit.TENSION_HIGH and failed[:1] != [(limit, axis)]:
                if fault.value > self._highest_N.get(axis, 0.0):
                    self._highest_N[axis] = fault.value
                    life.add_fault(fault)
            elif limit not in IN_DRIVES_FAULT and not any(
                axis == other if axis >= 0 else limit is known
                for known, other in failed
                if not (limit is Limit.BROKEN_CABLE and known is Limit.TENSION_HIGH)
            ):
                doubtful = limit is Limit.BROKEN_CABLE and self.pays_out_blind
                found = fault._replace(code=OR_LANDED) if doubtful else fault
                if (last := self._engine.parts.last_stop) and limit is Limit.BROKEN_CABLE:
                    last.broken[found.axis] = life.text(found)
                life.add_fault(self._engine.program_fault or found)

    def react(self, reaction: Reaction, torque_Nm: FloatArray, drives: Sequence[Fault]) -> None:
        """React to the supervisor's finding, within the same cycle.

        `torque_Nm` (n,) is the torque to be sent, `drives` are the faults of drives.
        """
        engine, supervisor, state = self._engine, self._supervisor, self._life.state
        if state not in (LoopState.READY, LoopState.ACTIVE):
            return  # in a fault the cause is known; the check of the bus has its own
        # in these cases neither a controlled stop nor lowering is possible
        uncontrolled = engine.lost_bus or (
            self.without_pose and supervisor.limit is Limit.NOT_FINITE
        )
        if uncontrolled:
            reaction = max(reaction, Reaction.QUICK_STOP)
        # lowering without a pose may be fast, because the lengths are correct
        unreliable = supervisor.limit in (
            {Limit.ENCODER_JUMP} if self.without_pose else LENGTHS_UNRELIABLE
        )
        if reaction > Reaction.HOLD and unreliable and self._lowering is not None:
            self._estimator.forget_lengths()
        if reaction <= engine.reacting and not self._invalidates_lowering():
            return
        fault = engine.program_fault or supervisor.fault()
        assert fault is not None  # only a fault causes a reaction
        if reaction is Reaction.HOLD:
            if engine.program.name != HOLD and engine.driving:
                engine.hold(fault)
            return
        if not self.reacts_to_fault:  # otherwise the fault is a further cause
            self._life.set_cause(fault, supervisor.reaction)
            for other in drives:
                self._life.add_fault(other)
            self._highest_N.clear()
            if (last := engine.parts.last_stop) and supervisor.limit is Limit.BROKEN_CABLE:
                last.broken[fault.axis] = self._life.text(fault)
        if state is LoopState.ACTIVE:
            self.stop(reaction, LoopState.FAULT, torque_Nm)
        else:
            self._machine.power_off()
            self.enter_fault()

    def _invalidates_lowering(self) -> bool:
        """Whether the supervisor's finding makes it unsafe to lower the platform by its pose."""
        lowers_by_pose = self._engine.driving and self.lowers and not self.without_pose
        return lowers_by_pose and self._supervisor.limit in POSE_UNRELIABLE

    def remove_power(self, error: Exception) -> None:
        """Remove the power immediately after an exception, for example of a program."""
        self._life.set_reason(f"{type(error).__name__}: {error}")
        if self._life.state is LoopState.ACTIVE:
            self.stop(Reaction.TORQUE_OFF, LoopState.FAULT)
        traceback.print_exception(error)  # afterwards, because writing may take long

    def stop(
        self, reaction: Reaction, then: LoopState, torque_Nm: FloatArray | None = None
    ) -> None:
        """End the motion by `reaction` and go to state `then`."""
        engine, method = self._engine, self._method(reaction, then)
        mistake = None
        if method in (StopMethod.BRAKE, StopMethod.LOWER_WITHOUT_POSE):
            mistake = self._begin(method)
        if mistake is not None:
            method = StopMethod.QUICK_STOP
        engine.reacting = Reaction.QUICK_STOP if method is StopMethod.QUICK_STOP else reaction
        if method in (StopMethod.QUICK_STOP, StopMethod.TORQUE_OFF):
            self._note_fall()
            if method is StopMethod.QUICK_STOP:
                self._machine.quick_stop()
            else:
                self._machine.power_off()
            engine.driving = False
            if torque_Nm is not None:
                torque_Nm[:] = 0.0
            engine.switch(IDLE)
        self._runner.begin(self.come_to_rest(then))
        if mistake is not None:
            traceback.print_exception(mistake)  # afterwards, because writing may take long

    def _note_fall(self) -> None:
        """Record that a platform falls, if no brakes hold it and it may be hanging on its
        cables.
        """
        last, lowering, engine = self._engine.parts.last_stop, self._lowering, self._engine
        if last is None or lowering is None or not self.lowers:
            return
        hangs = self.without_pose or not self._estimator.estimate.slack_allowed
        last.fallen = last.fallen or hangs or engine.program.name == lowering.program

    def _method(self, reaction: Reaction, then: LoopState) -> StopMethod:
        """Return the method to end the motion, depending on pose and drives."""
        if reaction is Reaction.QUICK_STOP:
            return StopMethod.QUICK_STOP
        if reaction is not Reaction.CONTROLLED_STOP or not self._engine.driving:
            return StopMethod.TORQUE_OFF
        failed = then is LoopState.FAULT and self._supervisor.limit in POSE_UNRELIABLE
        # If only the code of a program has failed, encoders and winches still work. If it fails
        # again while the platform is being lowered by its pose, the pose is no longer used.
        only_code = self._engine.program_fault is not None and not self.reacts_to_fault
        if self._lowering is None or not failed or only_code:
            return StopMethod.BRAKE
        return StopMethod.LOWER_WITHOUT_POSE if self.lowers else StopMethod.QUICK_STOP

    def _begin(self, method: StopMethod) -> Exception | None:
        """Make the program brake or lower; return its exception if it fails."""
        try:
            if method is StopMethod.LOWER_WITHOUT_POSE:
                self._lower_without_pose()
            else:
                self._engine.program.stop()
        except Exception as error:  # after any error of a program, the drives can still brake
            return error
        return None

    def _lower_without_pose(self) -> None:
        lowering = self._lowering
        assert lowering is not None  # this method requires a platform to lower
        if not self.without_pose:
            self.without_pose = True
            # without drives the platform falls, and no sensor measures where it lands
            self._note_fall()
            self._engine.switch(lowering.program, {"blind": True})

    def enter_fault(self) -> None:
        """Enter the state fault from a state without power."""
        self._runner.begin(self._fault_steps())

    # -- steps that take several cycles

    def _fault_steps(self) -> Steps:
        self._life.enter(LoopState.FAULT)
        self._engine.driving = False
        self._machine.set_brakes(False)
        yield
        self._engine.reacting = Reaction.NONE
        yield from self.explain()

    def come_to_rest(self, then: LoopState) -> Steps:
        """Wait for the end of a stop that has begun, then remove the drives' power."""
        engine, life, machine, runner = self._engine, self._life, self._machine, self._runner
        controlled = engine.driving
        if controlled:
            yield from self._brake()
        else:
            machine.set_brakes(False)
        yield from runner.wait_up_to(_POWER_OFF_S, machine.unpowered)
        machine.power_off()
        yield  # wait at least one cycle, so that the command is sent
        yield from runner.wait_up_to(_POWER_OFF_AT_LAST_S, machine.unpowered)
        unconfirmed: list[Fault] = []
        yield from runner.run_task(lambda: unconfirmed.extend(machine.confirm_power_off()))
        for fault in unconfirmed:
            life.add_fault(fault)
        if controlled or machine.has_brakes:  # without control the platform may have fallen
            yield from self._keep_lengths()
        if any(fault.code in IN_REASON for fault in life.faults.values()):
            then = LoopState.FAULT
        life.enter(then)
        engine.reacting = Reaction.NONE
        if then is LoopState.FAULT:
            yield from self.explain()

    def _brake(self) -> Steps:
        """Wait for standstill under the program, apply the brakes, remove the power.

        A platform without brakes is lowered first; if it does not come to rest, that is a fault.
        """
        engine, machine, wait_up_to = self._engine, self._machine, self._runner.wait_up_to
        lowering = self._lowering
        if lowering is None or engine.program.name != lowering.program:
            yield from wait_up_to(engine.program.rest_s, self._at_rest)
            engine.switch(lowering.program if lowering is not None and self.lowers else HOLD)
        if lowering is not None and self.lowers:
            yield from wait_up_to(lowering.longest_s, self._at_rest)
            with suppress(Exception):  # the power is removed even if the program raises
                if trouble := str(engine.program.progress().get("trouble", "")):
                    source = f"program {engine.program.name}"
                    self._life.add_fault(Fault(Limit.NONE, -1, PROGRAM, source, detail=trouble))
        else:
            yield from wait_up_to(_SETTLE_S, self._is_still)
        machine.set_brakes(False)
        yield from wait_up_to(_BRAKES_S, lambda: machine.brakes_are(False))
        machine.power_off()
        engine.driving = False
        engine.switch(IDLE)

    def _at_rest(self) -> bool:
        return self._engine.program.at_rest

    def _is_still(self) -> bool:
        return bool(np.max(np.abs(self._estimator.estimate.velocity_rad_s)) < _STILL_RAD_S)

    def _keep_lengths(self) -> Steps:
        """Store the cables' lengths for the next start, if they are known."""
        last, device = self._engine.parts.last_stop, self._machine.device
        if last is None or device is None:
            return
        estimate, feedback = self._estimator.estimate, device.feedback
        try:
            yield from self._runner.run_blocking(lambda: last.keep(estimate, feedback))
        except ControlError as error:
            self._engine.notices.append(str(error))

    def explain(self) -> Steps:
        """Add the faults reported by drives and safety I/O; stop the cycles on a lost bus."""
        found: list[Fault] = []
        yield from self._runner.run_task(lambda: found.extend(self._machine.explain()))
        for fault in found:
            cause = self._life.cause
            by_drive = cause is None or cause.limit in IN_DRIVES_FAULT
            # an open safety chain removes the drives' power
            self._life.add_fault(fault, as_cause=by_drive and fault.limit is not Limit.DRIVE)
        if self._engine.lost_bus:
            yield from self.leave_cycles()

    def leave_cycles(self) -> Steps:
        """Stop the cycles and pause the machine; ignore a lost bus."""
        self._engine.stop_cycles()
        try:
            yield from self._runner.run_task(self._machine.pause)
        except ControlError:
            return
