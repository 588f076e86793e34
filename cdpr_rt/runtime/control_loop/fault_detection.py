"""Detection of exceeded limits and failures in a cycle."""

from __future__ import annotations

import math

from cdpr_profiles.limits.robot_limits import Limit
from cdpr_rt.arrays import FloatArray
from cdpr_rt.core.cycle import Cycle
from cdpr_rt.core.states import LoopState, Reaction
from cdpr_rt.runtime.control_loop.engine import Engine
from cdpr_rt.runtime.control_loop.safe_stop import SafeStop


class FaultDetection:
    """Checks each cycle's torque, drives and safety I/O, and has `SafeStop` react."""

    def __init__(self, engine: Engine, safe_stop: SafeStop) -> None:
        self._engine = engine
        self._safe_stop = safe_stop

    def judge(self, cycle: Cycle, torque_Nm: FloatArray) -> int:
        """Limit the torque, (n,) in place; return the reaction to what was exceeded or failed."""
        engine, parts = self._engine, self._engine.parts
        supervisor = parts.supervisor
        reaction = 0
        engine.lengths_disagree_m = math.nan
        if engine.driving:
            estimate = parts.estimator.estimate
            feedback = cycle.device.feedback
            reaction = supervisor.check(feedback, estimate, engine.setpoint, torque_Nm)
            if parts.lengths_disagree is not None:
                engine.lengths_disagree_m, axis = parts.lengths_disagree()
                reaction = supervisor.compare_lengths(
                    estimate.elapsed_s, engine.lengths_disagree_m, axis
                )
        else:
            torque_Nm[:] = 0.0
        # in a fault the drives' alarms are known, and formatting them takes time
        known = engine.life.state is LoopState.FAULT or self._safe_stop.without_pose
        failure = engine.lost_bus or ("" if known else cycle.device.alarm())
        alarm = stop = ""
        if cycle.watches:
            alarm, stop = cycle.watch_alarm(), cycle.stop_reason()
        if failure or alarm or stop:
            if not engine.driving:
                supervisor.reset()
            for limit, reason in (
                (Limit.DRIVE, failure),
                (Limit.SAFETY_ALARM, alarm),
                (Limit.SAFETY_STOP, stop),
            ):
                if reason:
                    reaction = supervisor.report(limit, reason)
        if reaction > Reaction.CLAMP:
            self._safe_stop.react(Reaction(reaction), torque_Nm)
        return reaction
