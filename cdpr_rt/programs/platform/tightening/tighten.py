"""Program `tighten`: take up slack, pretension the cables, find the platform's pose."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from cdpr_rt.arrays import BoolArray, FloatArray
from cdpr_rt.control.winch_speed_loop import WinchSpeedLoop
from cdpr_rt.core.exchange import AxisFeedback, Setpoint
from cdpr_rt.programs.arguments import CommandArguments, ProgramError
from cdpr_rt.programs.platform.arrival import Arrival
from cdpr_rt.programs.platform.platform_program import PlatformParts, PlatformProgram
from cdpr_rt.programs.platform.tightening.index_path import index_path
from cdpr_rt.programs.platform.tightening.length_source import SOURCES, LengthSource
from cdpr_rt.programs.platform.tightening.letting_go import LettingGo
from cdpr_rt.programs.platform.tightening.slack import SlackTakeUp, Stillness
from cdpr_rt.programs.platform.tightening.slack_kernel import PULLED, TAKE_UP_SHARE, TAKE_UP_m_s
from cdpr_rt.programs.platform.tightening.standing import (
    bad_source,
    disagreement,
    hangs,
    rests_at_home,
    source_refusal,
    why_not_at_home,
    why_not_to_hold,
    why_not_to_pull,
    would_move,
)
from cdpr_rt.robots.standing_tensions import OVERSHOOT, StandingTensions

INDEX_m_s = 0.1
"""Speed of the platform during the search for indices."""
_SETTLING_S = 0.5
_RISE_1_s = 1.0
_FALL_S = 0.2
_HAND_OVER_S = 0.5
_SLACK_m, _ONCE_TIGHT_m = 1.0, 0.05
"""How far a cable may be wound in while some are slack, and once all are tight, besides stretch."""
_TIGHT_WITHIN_S = 60.0

_STAGES = (
    ("slack", TAKE_UP_SHARE), ("pull", 1.0), ("below", 2.0 - OVERSHOOT), ("back", 1.0),
    ("beyond", OVERSHOOT), ("lengths", 1.0),
)  # fmt: skip
_FITTED_FROM = 2
"""Stage from which angles tell what motors take up: the first rise takes winches along."""


class TightenProgram(PlatformProgram):
    """Takes up slack until all cables are tight and still, pretensions them, then holds.

    The platform stays on its stand meanwhile: tensions grow together to those whose wrench presses
    it down where the cables can, and has no horizontal component. The cables' lengths follow from
    home, where it has to stand then, from the estimate, or from the last stop. Where a motor's
    cogging is known but not its index, the platform is lifted until all have passed theirs. A cable
    that does not become tight, lengths that disagree, and a platform that by its cables' lengths is
    not where or as it is to be, end it: the cables are slackened again. A platform that hangs, as
    brakes have kept it, is held by its pose at once, from the torques of the last cycle on; where
    the pose does not follow from the lengths, the command is refused, and nothing changes.
    """

    name = "tighten"
    needs_lease = True

    def __init__(self, parts: PlatformParts, torque_Nm: FloatArray, cable_m: FloatArray) -> None:
        super().__init__(parts, torque_Nm)
        self._arrival = Arrival(parts.period_s, parts.near_m, _SETTLING_S)
        self._cable = np.array(cable_m)
        most_N = torque_Nm / np.abs(cable_m)
        self._standing = StandingTensions(
            parts.model, parts.control.low_N, most_N, parts.control.pull_fit.taken_up_N
        )
        self._home_pretension_N = self._standing.at(parts.model.home_pose)[0].copy()
        self._pretension_N = self._home_pretension_N.copy()
        self._from_N, self._to_N = self._pretension_N.copy(), self._pretension_N.copy()
        """Between which the pretension goes over to that for where the platform stands."""
        self._blend = 1.0
        self._hangs = self._hands_over = False
        self._let_go_cycle = 0
        self._checked = AxisFeedback(cable_m.size)
        inertia = np.full(cable_m.size, parts.control.inertia_kg_m2)
        self._winches = WinchSpeedLoop(inertia, cable_m, parts.period_s)
        self._slack = SlackTakeUp(self._winches, parts, self._cable, self._home_pretension_N)
        # a long cable comes in by its sag rather than by its stretch, from where friction has it
        shares = np.array([0.0, 0.5 * TAKE_UP_SHARE, OVERSHOOT])[:, None]
        lengths_m = [parts.control.lengths_at_home(N) for N in shares * self._pretension_N]
        self._once_tight_m = _ONCE_TIGHT_m + float(np.ptp(lengths_m, axis=0).max())
        self._start_rad = np.zeros(cable_m.size)
        self._enough_N, self._weak = np.zeros(cable_m.size), np.zeros(cable_m.size, np.bool_)
        self._stillness = Stillness(self._cable, parts.control.pull_fit.count_rad, parts.period_s)
        self._source = LengthSource(parts, self._cable, self._home_pretension_N)
        self._letting_go = LettingGo(parts, self._cable, self._home_pretension_N)
        self._stage = 0
        self._share = 0.0
        self._cycles = self._handing_over_cycles = 0
        self._feedback = AxisFeedback(cable_m.size)
        self._path: list[FloatArray] = []
        self._failure = ""

    def start(self, feedback: AxisFeedback, setpoint: Setpoint, torque_Nm: FloatArray) -> None:
        """Go on from the torque of the last cycle."""
        parts = self._parts
        parts.follow_origins()
        self._feedback = feedback
        self._failure = ""
        self._stopping = self._at_rest = False
        self._source.begin()
        self._pretension_N[:] = self._from_N[:] = self._to_N[:] = self._home_pretension_N
        self._blend, self._hangs, self._hands_over = 1.0, False, False
        self._stage = self._cycles = 0
        if parts.tight:
            super().start(feedback, setpoint, torque_Nm)
            self._look_for_indices()
            return
        self._start_rad[:] = feedback.position_rad
        self._stillness.begin(feedback.position_rad)
        self._slack.begin(feedback.position_rad)
        self._winches.begin(feedback, parts.estimator.estimate.velocity_rad_s, torque_Nm)
        self._control.clear_compensation()
        self._control.clear_notices()
        self._share = min(
            max(float(np.max(-torque_Nm / self._cable / self._pretension_N)), 0.0), 1.0
        )
        np.multiply(self._pretension_N, self._share, out=self._winches.high_N)

    def update(self, feedback: AxisFeedback, setpoint: Setpoint, torque_Nm: FloatArray) -> None:
        """Write this cycle's set-point and torques, (n,) each, in place."""
        if self._hangs:
            self._hold_hanging(feedback, setpoint, torque_Nm)
        if self._parts.tight:
            super().update(feedback, setpoint, torque_Nm)
            self._at_rest = self._at_rest and (self._stopping or self._arrival.over)
            return
        if self._hands_over:
            self._let_go(feedback, setpoint, torque_Nm)
            return
        self._bound_tension(feedback)
        self._winches.update(feedback, torque_Nm)
        if self._source.name == "home" and self._stage >= _FITTED_FROM:
            self._control.pull_fit.take(feedback.position_rad, self._winches.tension_N)
        setpoint.position_rad[:] = feedback.position_rad
        setpoint.velocity_rad_s[:] = setpoint.acceleration_rad_s2[:] = 0.0
        self._cycles += 1
        if self._stopping:
            self._at_rest = not self._winches.high_N.any()
        elif self._stillness.lasts(feedback.position_rad, self._pulls()):
            self._next_stage(feedback, torque_Nm)
        else:
            self._fail_if(self._trouble(feedback))

    def progress(self) -> dict[str, Any]:
        """Return the stage, the cables' tensions, and what went wrong."""
        tight = self._parts.tight
        held = tight or self._hands_over
        stage = _STAGES[self._stage][0] if not held else "index" if self._path else "held"
        done = tight and self._at_rest and not self._failure
        state = {"stage": stage, "tight": tight, "done": float(done), "trouble": self._failure}
        if tight:
            progress = super().progress()
            return {**progress, **state, "trouble": self._failure or progress["trouble"]}
        tension_N = self._control.tension_N if held else self._winches.tension_N
        return {"tension_N": tension_N.tolist(), **state}

    # -- commands

    def check(self, arguments: Mapping[str, Any]) -> tuple[str, bool]:
        """Return checked arguments for `apply`; raises ProgramError."""
        CommandArguments(self.name, arguments, ("from",))
        source = arguments.get("from", self._source.default)
        if source not in SOURCES:
            allowed = ", ".join(SOURCES)
            raise ProgramError(f"tighten: from: value {source!r}; allowed: {allowed}")
        if (refusal := source_refusal(self._parts, source, arguments)) is not None:
            raise ProgramError(refusal)
        return str(source), source != "home" and self._is_to_hold(source, arguments)

    def _is_to_hold(self, source: str, arguments: Mapping[str, Any]) -> bool:
        """Return whether the platform hangs where it is to be held; raises ProgramError.

        The control's estimate is of no use to others while cables may be slack: it is taken anew.
        """
        parts, now = self._parts, self._checked
        # another program may have ended the hand-over since
        handing_over = self._hands_over and self._feedback.cycle - self._let_go_cycle <= 1
        if parts.tight or handing_over or not hangs(parts):
            return False
        now.position_rad[:] = parts.estimator.position_rad
        length_m = self._source.before(source, now)
        if length_m is None or rests_at_home(parts, length_m, now):
            return False
        if why := why_not_to_hold(parts, self._standing, length_m, now):
            raise ProgramError(bad_source(arguments, why))
        return True

    def _apply(self, checked: tuple[str, bool]) -> None:
        self._source.name, self._hangs = checked

    def _hold_hanging(
        self, feedback: AxisFeedback, setpoint: Setpoint, torque_Nm: FloatArray
    ) -> None:
        """Go over to holding the platform where the check of the command found it."""
        self._hangs = False
        self._control.observe(feedback)
        self._source.take_last()
        self._take_over(feedback, torque_Nm)
        self._control.stand_still()
        self._finish(feedback, setpoint, torque_Nm)

    # -- taking up slack

    def _bound_tension(self, feedback: AxisFeedback) -> None:
        """Have the winches pull with a share of the pretension, or as their slack ended.

        Once it is stopped they are let down from what they may pull with by then.
        """
        high_N, step = self._winches.high_N, self._parts.period_s * _RISE_1_s
        self._winches.low_N[:], self._winches.paying_out_m_s[:] = 0.0, -TAKE_UP_m_s
        if self._stopping:
            high_N -= self._pretension_N * (self._parts.period_s / _FALL_S)
            np.maximum(high_N, 0.0, out=high_N)
            return
        self._share += min(max(_STAGES[self._stage][1] - self._share, -step), step)
        self._blend = min(self._blend + step, 1.0)
        self._pretension_N[:] = self._from_N + self._blend * (self._to_N - self._from_N)
        np.multiply(self._pretension_N, self._share, out=high_N)
        if self._stage == 0:
            share = self._share / TAKE_UP_SHARE
            if self._slack.update(feedback.position_rad, self._pretension_N, share):
                self._cycles = 0
        else:
            np.maximum(high_N, self._slack.tight_N, out=high_N)

    def _pulls(self) -> bool:
        """Return whether all winches pull with what they are to by now."""
        ready = self._share == _STAGES[self._stage][1] and self._blend == 1.0
        return ready and not self._not_tight().any()

    def _not_tight(self) -> BoolArray:
        """Return which cables are slack, or if none is, not pulled with what they may be, (n,)."""
        if self._stage == 0 and (slack := self._slack.not_tight).any():
            return slack
        np.multiply(self._winches.high_N, PULLED, out=self._enough_N)
        return np.less_equal(self._winches.tension_N, self._enough_N, out=self._weak)

    def _next_stage(self, feedback: AxisFeedback, torque_Nm: FloatArray) -> None:
        self._stillness.begin(feedback.position_rad)
        if self._stage == 0:
            self._start_rad[:] = feedback.position_rad
        if self._stage + 1 == len(_STAGES):
            self._end_tight(feedback, torque_Nm)
            return
        # elsewhere than at home lengths tell where the platform is, wherever it is pulled to
        stage = _STAGES[self._stage][0]
        matters = stage in ("slack", "pull") and self._source.name == "home"
        moved = self._slack.why_moved(feedback.position_rad, stage == "pull") if matters else ""
        if self._source.name == "home":  # else lengths are still those that it was told of
            self._parts.off_home = self._slack.off_home
        self._fail_if(moved or self._why_not_to_pull(feedback))
        if self._failure:
            return
        if stage == "slack":
            self._share = 0.0  # up from what the cables are pulled with
        elif stage == "pull":
            self._control.pull_fit.begin(feedback.position_rad)
        elif stage == "back":
            self._source.at_home.keep_rising(feedback)
        elif stage == "beyond" and self._source.name == "home":
            self._fail_if(self._source.at_home.slack_before(feedback, OVERSHOOT))
            if self._failure:
                return
        self._stage += 1

    def _end_tight(self, feedback: AxisFeedback, torque_Nm: FloatArray) -> None:
        """Take the lengths, and hold the platform where they have it, unless they disagree."""
        self._source.take_last()
        self._control.take_lengths(self._source.now(feedback), feedback)
        estimate = self._parts.estimator.estimate
        tension_N = np.where(estimate.tension_measured, estimate.tension_N, self._pretension_N)
        # as they stand: what the cables press with may stretch them otherwise than what is planned
        self._control.begin(feedback, tension_N)
        self._fail_if(disagreement(self._parts, self._source.name))
        if not self._failure:
            if self._source.name == "home":  # elsewhere than told nothing right is found
                self._control.pull_fit.begin_learning()
            self._control.begin(feedback)
            self._take_over(feedback, torque_Nm)
            self._hands_over, self._path = True, []
            self._let_go_cycle, self._handing_over_cycles = feedback.cycle, 0

    def _let_go(self, feedback: AxisFeedback, setpoint: Setpoint, torque_Nm: FloatArray) -> None:
        """Blend out what the platform is pressed on its stand with; then it may be moved.

        Meanwhile its cables are stretched otherwise than the control has it, so that the set-point
        stands wherever the control finds the platform: it is not pushed against its stand.
        """
        self._control.stand_still(on_stand=True)
        self._loop.update(feedback, setpoint, torque_Nm)
        self._handing_over_cycles += 1
        self._let_go_cycle = feedback.cycle
        over = self._handing_over_cycles * self._parts.period_s > _HAND_OVER_S
        slack = self._letting_go.runs_in()
        if over and not slack and self._source.name == "home":
            slack = self._letting_go.disagree()
        if slack:
            self._let_down(feedback, torque_Nm, slack)
        elif over:
            if self._source.name == "home":
                found = self._parts.off_home, self._letting_go.off_home()
                self._parts.off_home = "; ".join(filter(None, found))
            self._finish(feedback, setpoint, torque_Nm)

    def _let_down(self, feedback: AxisFeedback, torque_Nm: FloatArray, slack: str) -> None:
        """Have the winches let cables down that are slack, whose lengths are not those taken."""
        self._hands_over = False
        self._parts.estimator.forget_lengths()
        speed_rad_s = self._parts.estimator.estimate.velocity_rad_s
        # what drives a winch that runs in already holds nothing
        runs_in = speed_rad_s * self._cable < -TAKE_UP_m_s
        self._winches.begin(feedback, speed_rad_s, np.where(runs_in, 0.0, torque_Nm))
        np.maximum(-torque_Nm / self._cable, 0.0, out=self._winches.high_N)
        self._fail_if(slack)

    def _why_not_to_pull(self, feedback: AxisFeedback) -> str:
        """Return why not to pull on; tensions for where it stands follow from known lengths."""
        parts, length_m = self._parts, self._source.before(self._source.name, feedback)
        if length_m is None:
            return ""
        if self._source.name == "home":
            return why_not_at_home(parts, length_m, self._winches.high_N, feedback)
        why = why_not_to_pull(parts, length_m, self._winches.high_N, feedback)
        if why or self._stage > 0:
            return why
        tensions_N, stays = self._standing.at(parts.model.pose(parts.control.estimated))
        self._to_N[:], self._blend = tensions_N, 0.0
        return "" if stays else would_move(parts)

    def _take_over(self, feedback: AxisFeedback, torque_Nm: FloatArray) -> None:
        """Begin to have the platform's control ask for the torques, from those of this cycle on."""
        parts = self._parts
        parts.estimator.set_lengths(feedback.position_rad, self._control.free_lengths_m)
        parts.loop.take_over(feedback, torque_Nm)

    def _finish(self, feedback: AxisFeedback, setpoint: Setpoint, torque_Nm: FloatArray) -> None:
        stopping, self._hands_over = self._stopping, False
        parts = self._parts
        parts.cycle, parts.tight = feedback.cycle, True
        parts.last_stop.displaced = parts.last_stop.fallen = False
        parts.last_stop.broken = ""
        super().start(feedback, setpoint, torque_Nm)
        if stopping:
            self.stop()
        else:
            self._look_for_indices()

    def _trouble(self, feedback: AxisFeedback) -> str:
        moved_m = np.abs((feedback.position_rad - self._start_rad) * self._cable)
        if self._source.name == "home" and (dragged := self._slack.dragged(feedback.position_rad)):
            return dragged
        i = int(moved_m.argmax())
        # what stands does not move once its cables are tight
        allowed_m = self._once_tight_m if self._stage > 0 else _SLACK_m
        if moved_m[i] > allowed_m:
            return (
                f"{self._parts.names[i]}: {1e3 * moved_m[i]:.1f} mm reeled in and not tight, "
                f"{1e3 * allowed_m:.1f} mm allowed"
                + (": is its cable broken, unhooked, or wound off?" if self._stage == 0 else "")
            )
        if self._cycles * self._parts.period_s > _TIGHT_WITHIN_S:
            return self._late()
        return ""

    def _late(self) -> str:
        """Return which cables are not tight yet, and with what each is pulled."""
        told, weak = f"no further cable tight within {_TIGHT_WITHIN_S:g} s", self._not_tight()
        if weak.any():
            return f"{told}: {self._slack.pulls(weak)}"
        i = int(self._stillness.moved_m.argmax())
        pull_N = self._winches.tension_N[i]
        return f"{told}: {self._parts.names[i]} pulls with {pull_N:.1f} N and does not stand still"

    def _fail_if(self, trouble: str) -> None:
        self._failure = trouble
        self._stopping = bool(trouble)

    # -- the search for indices

    def _look_for_indices(self) -> None:
        """Start along a path on which all motors turn, where an index is needed."""
        parts, control = self._parts, self._control
        self._path = []
        if self._source.lacks_index(self._feedback).any():
            self._path = index_path(
                parts.model, self._cable, lambda there: not control.infeasibility(there)
            )
        if self._path:
            self._target[:] = self._path[0]
            self._acceleration[:] = parts.acceleration
            self._speed[:] = parts.speeds(INDEX_m_s)
        else:
            self._failure = self._source.check_by_indices(self._feedback)

    def _move(self) -> bool:
        arrived = self._approach()
        if not self._path:
            return arrived
        lacks = self._source.lacks_index(self._feedback)
        found = not lacks.any()
        if found or arrived:
            self._path = [] if found else self._path[1:]
            self._target[:] = self._path[0] if self._path else self._stopping_position()
            if not found and not self._path:
                names = (self._parts.names[i] for i in np.flatnonzero(lacks))
                self._failure = f"motors that have not passed their index: {', '.join(names)}"
            if found:
                self._failure = self._source.check_by_indices(self._feedback)
        return False
