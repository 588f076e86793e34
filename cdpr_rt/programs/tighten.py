"""Program `tighten`: take up slack, pretension the cables, find the platform's pose."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from cdpr_rt.arrays import BoolArray, FloatArray
from cdpr_rt.control.winch_speed_loop import WinchSpeedLoop
from cdpr_rt.core.exchange import AxisFeedback, Setpoint
from cdpr_rt.model.last_lengths import (
    StoppedLengths,
    index_disagreement,
    off_index_m,
)
from cdpr_rt.model.platform_model import PlatformModel
from cdpr_rt.model.standing_tensions import OVERSHOOT, StandingTensions
from cdpr_rt.programs import standing
from cdpr_rt.programs.base import CommandArguments, ProgramError
from cdpr_rt.programs.platform_program import Arrival, PlatformParts, PlatformProgram, distance_m
from cdpr_rt.programs.slack import PULLED, TAKE_UP_SHARE, SlackTakeUp, Stillness, TAKE_UP_m_s

# A path of the platform on which every motor passes its index pulse.

_TURNS = 1.05
"""Angle that each motor must turn, one turn with a margin."""
_STEPS = 16


def index_path(
    model: PlatformModel, cable_m: FloatArray, feasible: Callable[[FloatArray], bool]
) -> list[FloatArray]:
    """Return positions (d,) to visit in order from home, so that each motor turns once.

    The path goes straight up as far as needed, then to the sides, without rotation. All of it is in
    the workspace and at positions that are `feasible`. `cable_m` (n,) is paid out per radian.
    """
    platform, kinematics, k = model.platform, model.kinematics, model.positions
    low, high = np.array(platform.workspace_min_m), np.array(platform.workspace_max_m)
    home, unturned = model.home, np.zeros(model.size - k)
    needed_m = _TURNS * math.tau * np.abs(cable_m)
    shortest = longest = kinematics.lengths(model.pose(home))
    path: list[FloatArray] = []
    sides = itertools.product(*np.stack([low, high])[:, :-1].T)
    for aside in (home[: k - 1], *map(np.array, sides)):
        target = np.array([*aside, high[-1], *unturned])
        start = path[0] if path else home
        for step in range(1, _STEPS + 1):
            there = start + step / _STEPS * (target - start)
            inside = bool((there[:k] >= low).all()) or not path
            if not inside or not feasible(there):
                break
            rho = kinematics.lengths(model.pose(there))
            shortest, longest = np.minimum(shortest, rho), np.maximum(longest, rho)
            enough = bool((longest - shortest >= needed_m).all())
            if enough or step == _STEPS or not feasible(there + (target - start) / _STEPS):
                path.append(there)
                break
        if (longest - shortest >= needed_m).all():
            break
    return path


# Check that cables are tight while the force that presses a platform on its stand is released.

_AGREE_m = 0.002
"""Allowed disagreement of freshly measured lengths, in addition to stretch caused by friction."""
_OFF_HOME_m = 0.006
"""Distance from home, computed from lengths just measured there, that is not reported. Friction
on the stand causes up to 4 mm, which disappears when winches turn."""
_RUNS_IN_m_s = 0.2
"""Winch speed that is impossible with a tight cable while the platform stands."""
_REMEDY = (
    "take up slack by hand, hold the platform, or choose tensions above the "
    "friction of the winches: see `cdpr robot show`"
)


class LettingGo:
    """Detects slack cables that were mistaken for tight ones, by their speeds and lengths.

    Lengths that are measured where the platform stands agree at that pose, even with errors of the
    geometry. While tensions change to those that hold the platform, friction of the winches causes
    a small disagreement. A slack cable, which is reeled in at this time, causes a larger one.
    """

    def __init__(self, parts: PlatformParts, cable_m: FloatArray, pretension_N: FloatArray) -> None:
        """Take the pretension at home, (n,)."""
        self._parts, self._cable = parts, cable_m
        control = parts.control
        rubbed_N = pretension_N + control.pull_fit.taken_up_N
        stretch_m = control.lengths_at_home(pretension_N) - control.lengths_at_home(rubbed_N)
        self._allowed_m = min(parts.home_lengths_allowed_m, _AGREE_m + float(stretch_m.max()))
        self._inwards_m_s = np.zeros(cable_m.size)

    def runs_in(self) -> str:
        """Return the winch that reels in faster than possible with a tight cable, or ""."""
        velocity_rad_s = self._parts.estimator.estimate.velocity_rad_s
        np.multiply(velocity_rad_s, self._cable, out=self._inwards_m_s)
        i = int(self._inwards_m_s.argmin())
        if self._inwards_m_s[i] >= -_RUNS_IN_m_s:
            return ""
        return (
            f"{self._parts.names[i]}: its winch winds in at {-self._inwards_m_s[i]:.2f} m/s, "
            f"{_RUNS_IN_m_s:g} m/s allowed: its cable is broken, or was slack; {_REMEDY}"
        )

    def disagree(self) -> str:
        """Return how much lengths taken at home disagree, and the worst cable, as text; "" if
        little.
        """
        control = self._parts.control
        if control.residual_m <= self._allowed_m:
            return ""
        return (
            f"the cable lengths, just measured at home, disagree by {1e3 * control.residual_m:.1f} "
            f"mm{self._parts.suspects_text()}; {1e3 * self._allowed_m:.1f} mm allowed for "
            "friction: a cable was slack, or the platform has moved on its stand; "
            f"{_REMEDY}"
        )

    def off_home(self) -> str:
        """Return how far the platform is from home by lengths taken at home, as text; "" if near.

        If all cables sag more than expected, they do not contradict each other. This happens if the
        pull on heavy cables does not overcome the friction of their winches.
        """
        parts = self._parts
        here, home, k = parts.control.estimated, parts.model.home, parts.model.positions
        off_m = distance_m(here, home, parts.scale_m)
        if off_m <= _OFF_HOME_m:
            return ""
        off = f"{1e3 * float(np.linalg.norm(here[:k] - home[:k])):.0f} mm from there"
        if here.size > k:
            off += f", turned by {math.degrees(np.linalg.norm(here[k:])):.1f} deg"
        return (
            f"by the cable lengths, measured at home, the platform is {off}: targets will "
            "be wrong by this much or more; cables sagged or were slack, or the platform "
            f"has moved; {_REMEDY}, and tighten from home again"
        )


# Cable lengths of a platform that stands at home with tight cables.

_CAME_IN_m = 0.003
"""Length, in addition to twice its stretch, by which a tight cable may be reeled in when it is
pulled harder: friction had prevented this stretch before."""


class LengthsAtHome:
    """Lengths (n,) at home, for tensions measured by load cells or commanded to the motors.

    Without a load cell, the angle at the pretension is the one that the control's `pull_fit` finds,
    without friction and cogging. If that is not available, it is the mean of the angles reached
    from above and from below, in which friction cancels. Known cogging is corrected once the index
    is known.
    """

    def __init__(self, parts: PlatformParts, cable_m: FloatArray, pretension_N: FloatArray) -> None:
        """Take the pretension at home, (n,)."""
        n = cable_m.size
        self._parts, self._cable = parts, np.array(cable_m)
        self._rising_rad = np.zeros(n)
        self._rad = np.full(n, np.nan)
        """Angles at which lengths were taken; nan after their correction."""
        self._N, self._pretension_N = np.zeros(n), np.array(pretension_N)
        """Tensions that stretched the cables at these angles, and the pretension."""
        self._sure = np.zeros(n, np.bool_)
        """Whether each of these tensions is free of the motor's cogging and friction."""
        parts.control.pull_fit.prepare(pretension_N)

    def forget(self) -> None:
        """Discard the angles, because nothing is left to correct."""
        self._rad[:] = np.nan

    def keep_rising(self, feedback: AxisFeedback) -> None:
        """Keep the angles at the pretension, reached from below."""
        self._rising_rad[:] = feedback.position_rad

    def slack_before(self, feedback: AxisFeedback, harder: float) -> str:
        """Return the cable that was not tight when angles were stored, as text, or "".

        The cables are now pulled `harder`: a tight cable is then reeled in only by its stretch. The
        check is not needed if lengths can contradict each other.
        """
        parts, pull_N = self._parts, self._pretension_N
        if self._cable.size > parts.model.size:
            return ""
        in_m = (self._rising_rad - feedback.position_rad) * self._cable
        stretch_m = parts.control.lengths_at_home(pull_N)
        stretch_m -= parts.control.lengths_at_home(harder * pull_N)
        allowed_m = 2.0 * stretch_m + _CAME_IN_m
        i = int((in_m - allowed_m).argmax())
        if in_m[i] <= allowed_m[i]:
            return ""
        return (
            f"{parts.names[i]}: came in by {1e3 * in_m[i]:.1f} mm when its tension rose "
            f"from {pull_N[i]:.0f} N to {harder * pull_N[i]:.0f} N, "
            f"{1e3 * allowed_m[i]:.1f} "
            "mm allowed: the first tension did not overcome the friction of its winch, or "
            "the platform has moved on its stand; take up slack by hand, or hold the "
            "platform"
        )

    def take(self, feedback: AxisFeedback) -> FloatArray:
        """Return the lengths (n,) at the pretension, reached from above."""
        control, estimate = self._parts.control, self._parts.estimator.estimate
        measured, fitted_rad = estimate.tension_measured, control.pull_fit.end()
        middle_rad = 0.5 * (feedback.position_rad + self._rising_rad)
        found = np.isfinite(fitted_rad)
        self._sure[:] = measured | found
        self._rad[:] = np.where(found, fitted_rad, middle_rad)
        self._rad[measured] = feedback.position_rad[measured]
        self._N[:] = np.where(measured, estimate.tension_N, self._pretension_N)
        turned_m = self._cable * (feedback.position_rad - self._rad)
        return np.asarray(control.lengths_at_home(self._N) + turned_m)

    def correct(self, feedback: AxisFeedback) -> None:
        """Correct lengths for known cogging and friction, once the index is known.

        These torques were part of the tensions that stretched the cables.
        """
        parts, control, known = self._parts, self._parts.control, self._parts.compensation
        if known is None or np.isnan(self._rad).any():
            return
        torque_error_N = known.standing_Nm(self._rad, feedback) / self._cable
        torque_error_N[self._sure] = 0.0
        stretch_error_m = control.lengths_at_home(self._N + torque_error_N)
        stretch_error_m -= control.lengths_at_home(self._N)
        self.forget()
        length_m = parts.estimator.estimate.cable_length_m + stretch_error_m
        parts.estimator.set_lengths(feedback.position_rad, length_m)
        control.take_lengths(length_m, feedback)


# Source of the cable lengths when cables become tight, and indices that check these lengths.

SOURCES = ("home", "lengths", "last")


class LengthSource:
    """Lengths (n,) from `home`, the platform's stand, from the estimate, or from the last stop.

    `name` is one of `SOURCES`.
    """

    def __init__(self, parts: PlatformParts, cable_m: FloatArray, pretension_N: FloatArray) -> None:
        """Take the pretension at home, (n,)."""
        self._parts, self._cable = parts, cable_m
        self._last: StoppedLengths | None = None
        self.at_home = LengthsAtHome(parts, cable_m, pretension_N)
        self.name = "home"

    @property
    def default(self) -> str:
        """The source if none is requested."""
        return "lengths" if self._parts.pose_known else "home"

    def begin(self) -> None:
        """Begin again with the default source."""
        self.name, self._last = self.default, None

    def before(self, source: str, feedback: AxisFeedback) -> FloatArray | None:
        """Return the lengths (n,) known before tightening, None if unknown."""
        stopped, parts = self._parts.last_stop.lengths, self._parts
        if source == "last" and stopped is not None:
            return stopped.at(feedback.position_rad, self._cable)
        known = parts.pose_known and not parts.last_stop.contradicted
        return parts.estimator.estimate.cable_length_m if known else None

    def take_last(self) -> None:
        """Take the lengths of the last stop if they are the source; discard the lengths at home.

        The lengths of the last stop can be taken only once.
        """
        last = self._parts.last_stop.take()
        self._last = last if self.name == "last" else None
        self.at_home.forget()

    def now(self, feedback: AxisFeedback) -> FloatArray:
        """Return the cables' lengths, (n,), as they are now."""
        if self.name == "last" and self._last is not None:
            return self._last.at(feedback.position_rad, self._cable)
        if self.name == "lengths":
            return self._parts.estimator.estimate.cable_length_m
        return self.at_home.take(feedback)

    def lacks_index(self, feedback: AxisFeedback) -> BoolArray:
        """Return which indices (n,) are missing but needed.

        They are needed to compensate cogging and to check the lengths of the last stop.
        """
        compensated = self._parts.compensation
        wanted = np.zeros(self._cable.size, np.bool_)
        if compensated is not None:
            wanted |= compensated.available
        if self._last is not None:
            wanted |= np.isfinite(self._last.cable_at_index_m)
        return wanted & ~feedback.index_known

    def check_by_indices(self, feedback: AxisFeedback) -> str:
        """Correct the lengths by the indices; return how the indices contradict the last stop."""
        self.at_home.correct(feedback)
        parts, last = self._parts, self._parts.last_stop
        last.contradicted = ""
        if self._last is not None:
            length_m, allowed_m = parts.estimator.estimate.cable_length_m, parts.lengths_allowed_m
            off_m = off_index_m(self._last, length_m, feedback, self._cable)
            last.contradicted = index_disagreement(off_m, self._cable, allowed_m, parts.names)
        last.displaced = bool(last.contradicted)
        return last.contradicted


INDEX_m_s = 0.1
"""Speed of the platform during the search for indices."""
_SETTLING_S = 0.5
_RISE_1_s = 1.0
_FALL_S = 0.2
_HAND_OVER_S = 0.5
_SLACK_m, _ONCE_TIGHT_m = 1.0, 0.05
"""Largest length by which a cable may be wound in while some are slack, and after all are tight,
plus stretch."""
_TIGHT_WITHIN_S = 60.0

_STAGES = (
    ("slack", TAKE_UP_SHARE), ("pull", 1.0), ("below", 2.0 - OVERSHOOT), ("back", 1.0),
    ("beyond", OVERSHOOT), ("lengths", 1.0),
)  # fmt: skip
_FITTED_FROM = 2
"""Stage from which on angles show only friction and cogging; during the first rise of tension they
also show slack."""


class TightenProgram(PlatformProgram):
    """Takes up slack until all cables are tight and still, pretensions them, then holds.

    The platform stays on its stand: tensions grow together to values whose wrench is vertical and,
    if the cables can do that, presses it down. The cable lengths come from home, if the platform
    stands there, from the estimate, or from the last stop. If the cogging of a motor is known but
    its index is not, the platform is lifted until all motors have passed their index. The program
    ends and slackens the cables again if a cable does not become tight, if lengths disagree, or if
    the lengths show that the platform is not at the expected pose. If brakes have kept the platform
    hanging, the program holds it at its pose immediately, starting with the torques of the last
    cycle. If the lengths do not determine that pose, the command is rejected and nothing changes.
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
        """Pretensions between which the program blends, the last one for the position at which the
        platform stands."""
        self._blend = 1.0
        self._hangs = self._hands_over = False
        self._let_go_cycle = 0
        self._checked = AxisFeedback(cable_m.size)
        inertia = np.full(cable_m.size, parts.control.inertia_kg_m2)
        self._winches = WinchSpeedLoop(inertia, cable_m, parts.period_s)
        self._slack = SlackTakeUp(self._winches, parts, self._cable, self._home_pretension_N)
        # above the friction, a long cable is reeled in more because of its sag than of its stretch
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
        """Continue from the torque of the last cycle."""
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
        """Return the stage, the cables' tensions, and the failure."""
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
        if (refusal := standing.source_refusal(self._parts, source, arguments)) is not None:
            raise ProgramError(refusal)
        return str(source), source != "home" and self._is_to_hold(source, arguments)

    def _is_to_hold(self, source: str, arguments: Mapping[str, Any]) -> bool:
        """Return whether to hold a hanging platform at its pose; raises ProgramError.

        The pose is computed again, because the control's estimate is unreliable while cables may be
        slack.
        """
        parts, now = self._parts, self._checked
        # another program may have ended the hand-over in the meantime
        handing_over = self._hands_over and self._feedback.cycle - self._let_go_cycle <= 1
        if parts.tight or handing_over or not standing.hangs(parts):
            return False
        now.position_rad[:] = parts.estimator.position_rad
        length_m = self._source.before(source, now)
        if length_m is None or standing.rests_at_home(parts, length_m, now):
            return False
        if why := standing.why_not_to_hold(parts, self._standing, length_m, now):
            raise ProgramError(standing.bad_source(arguments, why))
        return True

    def _apply(self, checked: tuple[str, bool]) -> None:
        self._source.name, self._hangs = checked

    def _hold_hanging(
        self, feedback: AxisFeedback, setpoint: Setpoint, torque_Nm: FloatArray
    ) -> None:
        """Begin to hold the platform at the pose found by the check of the command."""
        self._hangs = False
        self._control.observe(feedback)
        self._source.take_last()
        self._take_over(feedback, torque_Nm)
        self._control.stand_still()
        self._finish(feedback, setpoint, torque_Nm)

    # -- taking up slack

    def _bound_tension(self, feedback: AxisFeedback) -> None:
        """Make the winches pull with a share of the pretension, or as at the end of the take-up.

        After a stop the bounds decrease from their present values.
        """
        high_N, step = self._winches.high_N, self._parts.period_s * _RISE_1_s
        self._winches.low_N[:], self._winches.paying_out_m_s[:] = 0.0, -TAKE_UP_m_s
        if self._stopping:
            high_N -= self._pretension_N * (self._parts.period_s / _FALL_S)
            np.maximum(high_N, 0.0, out=high_N)
            return
        self._share += min(max(_STAGES[self._stage][1] - self._share, -step), step)
        if self._blend < 1.0:
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
        """Return whether all winches pull with the tension of the present stage."""
        ready = self._share == _STAGES[self._stage][1] and self._blend == 1.0
        return ready and not self._not_tight().any()

    def _not_tight(self) -> BoolArray:
        """Return which cables are slack, or if none, which are pulled below their bound, (n,)."""
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
        # away from home, lengths give the pose of the platform even if it has moved
        stage = _STAGES[self._stage][0]
        matters = stage in ("slack", "pull") and self._source.name == "home"
        moved = self._slack.why_moved(feedback.position_rad, stage == "pull") if matters else ""
        if self._source.name == "home":  # otherwise the notice stays, with its lengths
            self._parts.off_home = self._slack.off_home
        self._fail_if(moved or self._why_not_to_pull(feedback))
        if self._failure:
            return
        if stage == "slack":
            self._share = 0.0  # the rise begins at the present pull of the cables
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
        """Take the lengths, and hold the platform at their pose, unless they disagree."""
        self._source.take_last()
        self._control.take_lengths(self._source.now(feedback), feedback)
        estimate = self._parts.estimator.estimate
        tension_N = np.where(estimate.tension_measured, estimate.tension_N, self._pretension_N)
        # begin with these tensions, which press the platform down and may stretch cables more than
        # planned ones
        self._control.begin(feedback, tension_N)
        self._fail_if(standing.disagreement(self._parts, self._source.name))
        if not self._failure:
            if self._source.name == "home":  # lengths of other sources may belong to another pose
                self._control.pull_fit.begin_learning()
            self._control.begin(feedback)
            self._take_over(feedback, torque_Nm)
            self._hands_over, self._path = True, []
            self._let_go_cycle, self._handing_over_cycles = feedback.cycle, 0

    def _let_go(self, feedback: AxisFeedback, setpoint: Setpoint, torque_Nm: FloatArray) -> None:
        """Fade out the force that presses the platform on its stand; after that it may move.

        During this time, the stretch of the cables differs from that in the control. So the
        set-point stays at the estimated pose, and the control does not push the platform against
        its stand.
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
                parts, found = self._parts, self._letting_go.off_home()
                off = parts.control.estimated - parts.model.home
                parts.off_home_by[:] = 0.0 if parts.off_home or not found else off
                parts.off_home = "; ".join(filter(None, (parts.off_home, found)))
            self._finish(feedback, setpoint, torque_Nm)

    def _let_down(self, feedback: AxisFeedback, torque_Nm: FloatArray, slack: str) -> None:
        """Pay out the cables because one of them is slack, so that the lengths taken are wrong."""
        self._hands_over = False
        self._parts.estimator.forget_lengths()
        speed_rad_s = self._parts.estimator.estimate.velocity_rad_s
        # the torque of a winch that winds in fast does not hold a load
        runs_in = speed_rad_s * self._cable < -TAKE_UP_m_s
        self._winches.begin(feedback, speed_rad_s, np.where(runs_in, 0.0, torque_Nm))
        np.maximum(-torque_Nm / self._cable, 0.0, out=self._winches.high_N)
        self._fail_if(slack)

    def _why_not_to_pull(self, feedback: AxisFeedback) -> str:
        """Return the reason why the cables must not be pulled further, or "".

        If lengths are known, also set the tensions for their pose.
        """
        parts, length_m = self._parts, self._source.before(self._source.name, feedback)
        if length_m is None:
            return ""
        if self._source.name == "home":
            return standing.why_not_at_home(parts, length_m, self._winches.high_N, feedback)
        why = standing.why_not_to_pull(parts, length_m, self._winches.high_N, feedback)
        if why or self._stage > 0:
            return why
        tensions_N, stays = self._standing.at(parts.model.pose(parts.control.estimated))
        self._to_N[:], self._blend = tensions_N, 0.0
        return "" if stays else standing.would_move(parts)

    def _take_over(self, feedback: AxisFeedback, torque_Nm: FloatArray) -> None:
        """Begin to use the torques of the platform's control, starting from those of this cycle."""
        parts = self._parts
        parts.estimator.set_lengths(feedback.position_rad, self._control.free_lengths_m)
        parts.loop.take_over(feedback, torque_Nm)

    def _finish(self, feedback: AxisFeedback, setpoint: Setpoint, torque_Nm: FloatArray) -> None:
        stopping, self._hands_over = self._stopping, False
        parts = self._parts
        parts.cycle, parts.tight = feedback.cycle, True
        parts.last_stop.displaced = parts.last_stop.fallen = False
        parts.last_stop.broken.clear()
        super().start(feedback, setpoint, torque_Nm)
        if stopping:
            self.stop()
        else:
            self._look_for_indices()

    def _trouble(self, feedback: AxisFeedback) -> str:
        moved_m = np.abs((feedback.position_rad - self._start_rad) * self._cable)
        if self._winches.stuck.any():
            return (
                f"{self._parts.names[int(self._winches.stuck.argmax())]}: its motor was pushed to "
                "pay out cable, and its encoder shows no motion: the encoder or the winch is "
                "stuck, or the cable is caught; check them before you tighten again"
            )
        if (noisy := self._winches.noisy).any():
            return (
                f"{self._parts.names[int(noisy.argmax())]}: its encoder shows mostly noise, so its "
                "winch gets no torque; check its cable, shield and supply before you tighten again"
            )
        if self._source.name == "home" and (dragged := self._slack.dragged(feedback.position_rad)):
            return dragged
        i = int(moved_m.argmax())
        # a platform on its stand does not move once its cables are tight
        allowed_m = self._once_tight_m if self._stage > 0 else _SLACK_m
        if moved_m[i] > allowed_m:
            pull_N = self._winches.tension_N[i]
            by_hand = "" if self._stage > 0 else "; or it has more slack: take up slack by hand;"
            found = (
                f"{self._parts.names[i]}: {1e3 * moved_m[i]:.1f} mm reeled in without becoming "
                f"tight, {1e3 * allowed_m:.1f} mm allowed: its winch turns at {pull_N:.0f} N; its "
                f"cable is broken, unhooked, or wound off its drum{by_hand or ','} or the platform "
                "is not at home: put it there"
            )
            self._parts.last_stop.broken.setdefault(i, found)
            return found
        if self._cycles * self._parts.period_s > _TIGHT_WITHIN_S:
            return self._late()
        return ""

    def _late(self) -> str:
        """Return as text which cables are not tight yet, and the pull on each."""
        late, weak = (
            f"no further cable became tight within {_TIGHT_WITHIN_S:g} s",
            self._not_tight(),
        )
        if weak.any():
            return f"{late}: {self._slack.pulls(weak)}"
        i = int(self._stillness.moved_m.argmax())
        pull_N = self._winches.tension_N[i]
        return f"{late}: {self._parts.names[i]} pulls with {pull_N:.1f} N and keeps moving"

    def _fail_if(self, trouble: str) -> None:
        self._failure = trouble
        self._stopping = bool(trouble)
        if trouble:
            names, broken = self._parts.names, self._parts.last_stop.broken
            others = [why for i, why in broken.items() if not trouble.startswith(f"{names[i]}: ")]
            if others:
                self._failure += f"; before that, {'; '.join(others)}: has this been repaired?"

    # -- the search for indices

    def _look_for_indices(self) -> None:
        """Start a path on which all motors turn, if an index is needed."""
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
