"""Taking up the slack of a robot's cables, and learning where its platform is."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from cdpr_rt.exchange import AxisFeedback, FloatArray, Setpoint
from cdpr_rt.robots.planar_kernel import G_m_s2
from cdpr_rt.robots.planar_tensions import PlanarTensions
from cdpr_rt.runtime.last_lengths import StoppedLengths, off_index_m
from cdpr_rt.runtime.programs.base import ProgramError
from cdpr_rt.runtime.programs.index_way import index_way
from cdpr_rt.runtime.programs.platform_program import PlatformParts, PlatformProgram
from cdpr_rt.runtime.programs.reel import Reel
from cdpr_rt.runtime.programs.wanted import Wanted

REEL_m_s = 0.05
"""How fast slack comes in."""
GENTLE = 0.4
"""What cables are pulled with while some are slack, as a share of what they get."""
BEYOND = 1.5
"""How much harder they are pulled for a moment: coming back from there friction acts the other
way, and what it does to the angles on the way up and down cancels out."""
INDEX_m_s = 0.1
"""How fast the platform is lifted while indices are looked for."""
_STANDING = 0.85
_HIGHEST = 0.9
_SETTLING_S = 0.5
_HANGING = 0.5
_RISE_1_s = 1.0
_FALL_S = 0.2
_STILL_m = 0.0003
_STILL_S = 0.3
_PULLED = 0.95
_MOST_m, _ONCE_TIGHT_m = 1.0, 0.05
_MOST_S = 60.0

_STAGES = (("slack", GENTLE), ("pull", 1.0), ("beyond", BEYOND), ("lengths", 1.0))
_SOURCES = ("home", "lengths", "last")


class TightenProgram(PlatformProgram):
    """Pulls slack cables gently until all are tight and stand still; then keeps the platform.

    The platform stands firm meanwhile: tensions grow together, in shares whose sum presses it down
    where its cables can, and never pulls it sideways. Its cables' lengths follow from home, where
    it has to stand then, from what is known of them, or from the last stop. Where a motor's cogging
    is known but not its index, the platform is lifted until all have passed theirs. A cable that
    does not become tight, and lengths that disagree, end it: the cables are let go again.
    """

    name = "tighten"
    needs_lease = True

    def __init__(self, parts: PlatformParts, torque_Nm: FloatArray, cable_m: FloatArray) -> None:
        super().__init__(parts, torque_Nm)
        self._cable = np.array(cable_m)
        self._full_N = np.minimum(standing_tensions(parts), torque_Nm / np.abs(cable_m) / BEYOND)
        inertia = np.full(3, parts.control.inertia_kg_m2)
        self._reel = Reel(inertia, cable_m, parts.period_s)
        self._reel.paying_out_m_s[:] = -REEL_m_s
        tight_m = parts.control.lengths_at_home(BEYOND * self._full_N)
        stretch_m = parts.control.lengths_at_home(np.zeros(3)) - tight_m
        self._once_tight_m = _ONCE_TIGHT_m + float(stretch_m.max())
        self._begun, self._here, self._up = np.zeros(3), np.zeros(3), np.zeros(3)
        self._stood = np.full(3, np.nan)
        """Angles at which lengths were taken at home, until what the motors took up was told."""
        self._stage = 0
        self._share = 0.0
        self._still = self._cycles = 0
        self._source = "home"
        self._last: StoppedLengths | None = None
        self._feedback = AxisFeedback(3)
        self._way: list[FloatArray] = []
        self._why = ""

    def start(self, feedback: AxisFeedback, setpoint: Setpoint, torque_Nm: FloatArray) -> None:
        """Go on from the torque of the last cycle, whatever it pulled."""
        parts = self._parts
        self._feedback = feedback
        self._why = ""
        self._stopping = self._at_rest = False
        self._source = self._usual_source()
        self._last = None
        self._stage = self._still = self._cycles = 0
        if parts.tight:
            super().start(feedback, setpoint, torque_Nm)
            self._look_for_indices()
            return
        self._begun[:] = self._here[:] = feedback.position_rad
        self._reel.begin(feedback, parts.estimator.estimate.velocity_rad_s, torque_Nm)
        self._control.compensation_Nm[:] = 0.0
        self._share = min(max(float(np.max(-torque_Nm / self._cable / self._full_N)), 0.0), 1.0)

    def update(self, feedback: AxisFeedback, setpoint: Setpoint, torque_Nm: FloatArray) -> None:
        """Write this cycle's set-point and torques, (3,) each, in place."""
        if self._parts.tight:
            super().update(feedback, setpoint, torque_Nm)
            return
        goal = 0.0 if self._stopping else _STAGES[self._stage][1]
        step = self._parts.period_s * (1.0 / _FALL_S if self._stopping else _RISE_1_s)
        self._share += min(max(goal - self._share, -step), step)
        np.multiply(self._full_N, self._share, out=self._reel.high_N)
        self._reel.update(feedback, torque_Nm)
        setpoint.position_rad[:] = feedback.position_rad
        setpoint.velocity_rad_s[:] = setpoint.acceleration_rad_s2[:] = 0.0
        self._cycles += 1
        if self._stopping:
            self._at_rest = self._share == 0.0
        elif self._stands_still(feedback, self._share == goal):
            self._next_stage(feedback, setpoint, torque_Nm)
        else:
            self._give_up_if(self._trouble(feedback))

    def progress(self) -> dict[str, Any]:
        """Return how far it is, how hard the cables are pulled, and what stands in the way."""
        tight = self._parts.tight
        stage = _STAGES[self._stage][0] if not tight else "index" if self._way else "held"
        done = tight and not self._way and self._settled
        told = {"stage": stage, "tight": tight, "done": float(done), "trouble": self._why}
        if tight:
            return {**super().progress(), **told}
        return {"tension_N": self._reel.tension_N.tolist(), **told}

    # -- what is wanted

    def _usual_source(self) -> str:
        return "lengths" if self._parts.known else "home"

    def _parsed(self, wanted: Mapping[str, Any]) -> str:
        Wanted(self.name, wanted, ("from",))
        if wanted and self._parts.tight:
            raise ProgramError("tighten: from: the cables are tight already; lower it first")
        source, last = wanted.get("from", self._usual_source()), self._parts.last
        if source not in _SOURCES:
            allowed = ", ".join(_SOURCES)
            raise ProgramError(f"tighten: from: value {source!r}; allowed: {allowed}")
        if source == "home" and last.displaced and not wanted:
            raise ProgramError(
                "tighten: from: the platform was let go elsewhere, and where it stands is not "
                "known; stand it at home, then say from: home"
            )
        if source == "lengths" and not self._parts.known:
            raise ProgramError("tighten: from: the cables' lengths are not known; allowed: home")
        if source == "last" and last.lengths is None:
            raise ProgramError(f"tighten: from: no lengths of the last stop: {last.why}")
        return str(source)

    def _take(self, source: str) -> None:
        self._source = source
        hanging = self._parts.estimator.estimate.tension_N >= _HANGING * self._control.least_N
        if source != "home" and bool(hanging.all()) and not self._parts.tight:
            self._stage = len(_STAGES) - 1  # brakes have kept it where it was
            self._share = 1.0

    # -- taking up slack

    def _stands_still(self, feedback: AxisFeedback, pulling: bool) -> bool:
        reel = self._reel
        pulling = pulling and bool((reel.tension_N > _PULLED * reel.high_N).all())
        moved_m = np.abs((feedback.position_rad - self._here) * self._cable).max()
        if not pulling or moved_m > _STILL_m:
            self._here[:] = feedback.position_rad
            self._still = 0
        self._still += 1
        return self._still * self._parts.period_s > _STILL_S

    def _next_stage(
        self, feedback: AxisFeedback, setpoint: Setpoint, torque_Nm: FloatArray
    ) -> None:
        self._still = 0
        if self._stage == 0:
            self._begun[:] = feedback.position_rad
        if _STAGES[self._stage][0] == "pull":
            self._up[:] = feedback.position_rad
        if self._stage + 1 < len(_STAGES):
            self._stage += 1
            return
        last = self._parts.last.take()
        self._last = last if self._source == "last" else None
        self._control.take_lengths(self._lengths(feedback), feedback)
        self._control.begin(feedback)
        allowed_m = self._parts.lengths_allowed_m
        if self._control.residual_m > allowed_m:
            self._give_up_if(
                f"the cables' lengths disagree by {1e3 * self._control.residual_m:.0f} mm, "
                f"{1e3 * allowed_m:.0f} mm allowed; stand the platform at home and tighten from it"
            )
            return
        self._finish(feedback, setpoint, torque_Nm)

    def _lengths(self, feedback: AxisFeedback) -> FloatArray:
        """Return the cables' lengths, (3,), as they are now."""
        self._stood[:] = np.nan
        if self._source == "last" and self._last is not None:
            return self._last.at(feedback.position_rad, self._cable)
        if self._source == "lengths":
            return self._parts.estimator.estimate.cable_length_m
        self._stood[:] = 0.5 * (feedback.position_rad + self._up)
        hysteresis = 0.5 * self._cable * (feedback.position_rad - self._up)
        return self._control.lengths_at_home(self._full_N) + hysteresis

    def _finish(self, feedback: AxisFeedback, setpoint: Setpoint, torque_Nm: FloatArray) -> None:
        parts, control = self._parts, self._control
        parts.estimator.set_lengths(feedback.position_rad, control.free_lengths_m)
        control.stand_still()
        parts.loop.take_over(feedback, torque_Nm)
        parts.cycle = feedback.cycle
        parts.tight, parts.last.displaced = True, False
        self._cycles = 0
        super().start(feedback, setpoint, torque_Nm)
        self._look_for_indices()

    def _trouble(self, feedback: AxisFeedback) -> str:
        way = np.abs((feedback.position_rad - self._begun) * self._cable)
        most = int(way.argmax())
        # what stands at home does not move once its cables are tight
        firm = self._stage > 0 and self._source == "home"
        allowed_m = self._once_tight_m if firm else _MOST_m
        if way[most] > allowed_m:
            told = f"{way[most]:.2f} m reeled in and not tight, {allowed_m:.2g} m allowed"
            return f"cable {most}: {told}"
        if self._cycles * self._parts.period_s > _MOST_S:
            return f"not tight within {_MOST_S:g} s"
        return ""

    def _give_up_if(self, why: str) -> None:
        self._why = why
        self._stopping = bool(why)

    # -- finding indices

    def _look_for_indices(self) -> None:
        """Set out on a way on which all motors turn, where an index is wanted."""
        parts, control = self._parts, self._control
        self._way = []
        if self._wants_index():
            self._way = index_way(
                parts.platform, self._cable, lambda there: not control.feasible(there)
            )
        if self._way:
            self._target[:] = self._way[0]
            self._speed[:] = np.minimum(INDEX_m_s, parts.speed_m_s)
        else:
            self._take_motors_out()

    @property
    def _settled(self) -> bool:
        """Whether the platform's control has had the time to bring its tensions about."""
        return self._cycles * self._parts.period_s > _SETTLING_S

    def _wants_index(self) -> bool:
        """Whether an index is missing that compensation needs, or that checks the last lengths."""
        last, known = self._last, self._feedback.index_known
        if last is not None and bool((np.isfinite(last.cable_at_index_m) & ~known).any()):
            return True
        return self._parts.wants_index(self._feedback)

    def _move(self) -> bool:
        arrived = self._approach()
        self._cycles += 1
        if not self._way:
            return arrived and self._settled
        found = not self._wants_index()
        if found or arrived:
            self._way = [] if found else self._way[1:]
            self._target[:] = self._way[0] if self._way else self._resting_place()
            if not found and not self._way:
                self._why = "a motor has not passed its index"
            if found:
                self._take_motors_out()
                self._why = self._compare_indices()
        return False

    def _take_motors_out(self) -> None:
        """Correct lengths taken at home, with torques of which the motors took up a part.

        It is known now how much pulled at the cables, and how far these stretched.
        """
        parts, control, known = self._parts, self._control, self._parts.compensation
        if known is None or np.isnan(self._stood).any():
            return
        more_N = known.standing_Nm(self._stood, self._feedback) / self._cable
        more_m = control.lengths_at_home(self._full_N + more_N)
        more_m -= control.lengths_at_home(self._full_N)
        self._stood[:] = np.nan
        length_m = parts.estimator.estimate.cable_length_m + more_m
        parts.estimator.set_lengths(self._feedback.position_rad, length_m)
        control.take_lengths(length_m, self._feedback)

    def _compare_indices(self) -> str:
        """Return which index is not where the last stop's lengths have it, or an empty text."""
        last = self._last
        if last is None:
            return ""
        length_m = self._parts.estimator.estimate.cable_length_m
        off = np.abs(off_index_m(last, length_m, self._feedback, self._cable))
        off[np.isnan(off)] = 0.0
        worst, allowed_m = int(off.argmax()), self._parts.lengths_allowed_m
        if off[worst] <= allowed_m:
            return ""
        return (
            f"cable {worst}: its motor's index is {1e3 * off[worst]:.0f} mm from where the last "
            f"stop has it, {1e3 * allowed_m:.0f} mm allowed: lower, and tighten from home"
        )


def standing_tensions(parts: PlatformParts) -> FloatArray:
    """Return tensions (3,) under which a platform at home stands firm on what it stands on.

    None is below the least that is planned with, or at least allowed. Together they press it down
    with its own weight, where some cable pulls downward; else they carry part of its weight, and
    even beyond do not lift it.
    """
    J = parts.geometry.jacobian(np.array(parts.platform.home_m))
    weight = np.array([0.0, parts.platform.mass_kg * G_m_s2])
    control = parts.control
    most = np.maximum(_HIGHEST * parts.most_N / BEYOND, 1.1 * control.least_N)
    for least in (np.minimum(control.tensions.low, 0.9 * most), control.least_N):
        pressed, missing = PlanarTensions(least, most).distribute(J, weight)
        if not missing:
            return pressed
    hanging, _ = PlanarTensions(control.least_N, most).distribute(J, -weight)
    return np.maximum(_STANDING / BEYOND * hanging, 0.0)
