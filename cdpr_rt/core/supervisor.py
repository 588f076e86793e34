"""The last word between controller and drives: every limit, and what is done about it."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any, Final

import numpy as np

from cdpr_rt.arrays import BoolArray, FloatArray
from cdpr_rt.core.estimate import AxisEstimate
from cdpr_rt.core.exchange import AxisFeedback, Setpoint
from cdpr_rt.core.limits import DEFAULT_REACTIONS, Limit, Limits
from cdpr_rt.core.states import Reaction
from cdpr_rt.jit import bound, jit

__all__ = ["Limit", "Limits", "Supervisor"]


# kernels take plain numbers
_TORQUE, _TORQUE_RATE = int(Limit.TORQUE), int(Limit.TORQUE_RATE)
_SPEED, _FOLLOWING_ERROR = int(Limit.SPEED), int(Limit.FOLLOWING_ERROR)
_CABLE_LENGTH, _TENSION_SENSOR = int(Limit.CABLE_LENGTH), int(Limit.TENSION_SENSOR)
_TENSION_LOW, _TENSION_HIGH = int(Limit.TENSION_LOW), int(Limit.TENSION_HIGH)
_SLACK, _BROKEN_CABLE = int(Limit.SLACK), int(Limit.BROKEN_CABLE)
_STALE, _LATE, _NOT_FINITE = int(Limit.STALE), int(Limit.LATE), int(Limit.NOT_FINITE)
_MISSED, _MISSED_IN_WINDOW = int(Limit.MISSED), int(Limit.MISSED_IN_WINDOW)
_ENCODER_JUMP = int(Limit.ENCODER_JUMP)

_FIGURES: Final = tuple(name for name in Limits.__dataclass_fields__ if name != "reactions")
_LIMITS: Final = np.dtype([(name, "<f8") for name in (*_FIGURES, "period_s")])
_PAST: Final = np.dtype(
    [
        ("torque", "<f8"),  # as passed on in the last cycle
        ("missed", "<f8"),  # consecutive
        ("in_window", "<f8"),
        ("window_index", "<i8"),  # where in the window the last cycle is
        ("stale", "<f8"),
        ("low_s", "<f8"),  # since the tension was last sufficient
        ("slack_s", "<f8"),
        ("tight_rad", "<f8"),  # motor angle when it was
        ("low_armed", "<f8"),  # whether it was since enabling, or since this was told last
        ("slack_armed", "<f8"),
        ("mean_N", "<f8"),  # its tension, low-passed
        ("valid_count", "<f8"),  # valid angles since enabling, up to 2
        ("valid_rad", "<f8"),  # the last valid angle
        ("velocity_rad_s", "<f8"),  # then
        ("invalid_s", "<f8"),  # since the last valid angle
    ]
)
_VERDICT: Final = np.dtype(
    [("reaction", "<i8"), ("limit", "<i8"), ("axis", "<i8"), ("value", "<f8"), ("allowed", "<f8")]
)
# an angle may be so far from where its pace leads, besides a change of pace by what is allowed
_JUMP_rad = 0.05
# a cable that runs in has snapped where its tension is less than a share of its mean
_SNAPPED_SHARE, _MEAN_S = 0.6, 0.1
# a cable is not broken where this much was paid out while its tension fell
_PAID_OUT_m: Final = 5e-4


@jit
def _judge(
    verdict: Any, reactions: Any, limit: int, axis: int, value: float, allowed: float
) -> None:
    """Keep the most severe of what was exceeded in this cycle, the first of equals."""
    reaction = reactions[limit]
    if reaction > verdict[0]["reaction"]:
        verdict[0]["reaction"], verdict[0]["limit"], verdict[0]["axis"] = reaction, limit, axis
        verdict[0]["value"], verdict[0]["allowed"] = value, allowed


@jit
def _bound_torque(
    i: int, lim: Any, past: Any, reactions: Any, verdict: Any, period: float, torque: FloatArray
) -> None:
    wanted = torque[i]
    if not np.isfinite(wanted):
        _judge(verdict, reactions, _NOT_FINITE, i, wanted, 0.0)
        wanted = 0.0
    most, rate = lim["torque_Nm"], lim["torque_rate_Nm_s"]
    if abs(wanted) > most:
        _judge(verdict, reactions, _TORQUE, i, wanted, most)
        wanted = min(max(wanted, -most), most)
    step = wanted - past["torque"]
    if abs(step) > rate * period:
        _judge(verdict, reactions, _TORQUE_RATE, i, step / period, rate)
        wanted = past["torque"] + min(max(step, -rate * period), rate * period)
    past["torque"] = torque[i] = wanted


@jit
def _watch_answers(
    i: int, lim: Any, past: Any, reactions: Any, verdict: Any, valid: bool, fair: bool, window: Any
) -> None:
    missed = 0 if valid else 1
    # where this cycle's flag goes, that of one window ago still is
    past["window_index"] = index = (past["window_index"] + 1) % window.shape[0]
    past["missed"] = 0.0 if valid else past["missed"] + 1.0
    past["in_window"] += missed - window[index, i]
    window[index, i] = missed
    past["stale"] = 0.0 if fair else past["stale"] + 1.0
    if past["missed"] > lim["missed_cycles"]:
        _judge(verdict, reactions, _MISSED, i, past["missed"], lim["missed_cycles"])
    if past["in_window"] > lim["missed_in_window"]:
        _judge(verdict, reactions, _MISSED_IN_WINDOW, i, past["in_window"], lim["missed_in_window"])
    if past["stale"] > lim["stale_cycles"]:
        _judge(verdict, reactions, _STALE, i, past["stale"], lim["stale_cycles"])


@jit
def _watch_jumps(
    i: int, lim: Any, past: Any, reactions: Any, verdict: Any, elapsed: float, position: float
) -> None:
    past["invalid_s"] += elapsed
    step = position - past["valid_rad"]
    jump = step - past["velocity_rad_s"] * past["invalid_s"]
    possible = lim["speed_rad_s"] * past["invalid_s"] + _JUMP_rad
    if past["valid_count"] == 2.0 and abs(jump) > possible:
        _judge(verdict, reactions, _ENCODER_JUMP, i, jump, possible)
    past["velocity_rad_s"] = step / past["invalid_s"] if past["valid_count"] else 0.0
    past["valid_count"] = min(past["valid_count"] + 1.0, 2.0)
    past["valid_rad"], past["invalid_s"] = position, 0.0


@jit
def _watch_motion(
    i: int,
    lim: Any,
    reactions: Any,
    verdict: Any,
    error: float,
    velocity: float,
    length: float,
    paying_out: float,
) -> None:
    # a value that is not a number is not within its limit either
    if not abs(velocity) <= lim["speed_rad_s"]:
        _judge(verdict, reactions, _SPEED, i, velocity, lim["speed_rad_s"])
    if not abs(error) <= lim["following_error_rad"]:
        _judge(verdict, reactions, _FOLLOWING_ERROR, i, error, lim["following_error_rad"])
    # beyond a length only the way back is open
    if length > lim["cable_length_max_m"] and paying_out > 0.0:
        _judge(verdict, reactions, _CABLE_LENGTH, i, length, lim["cable_length_max_m"])
    if length < lim["cable_length_min_m"] and paying_out < 0.0:
        _judge(verdict, reactions, _CABLE_LENGTH, i, length, lim["cable_length_min_m"])


@jit
def _has_snapped(lim: Any, past: Any, elapsed: float, tension: float, winding_in: float) -> bool:
    """Whether a cable that was tight comes in faster than it may and has lost its tension."""
    before = past["mean_N"]
    if np.isfinite(tension):
        past["mean_N"] += elapsed / (elapsed + _MEAN_S) * (tension - before)
    runs_away = past["slack_armed"] != 0.0 and winding_in > lim["speed_rad_s"]
    return bool(runs_away and tension < _SNAPPED_SHARE * before)


@jit
def _watch_tension(
    i: int,
    lim: Any,
    past: Any,
    reactions: Any,
    verdict: Any,
    elapsed: float,
    tension: float,
    slack_allowed: bool,
    position: float,
    cable_m_per_rad: float,
) -> None:
    if tension > lim["tension_max_N"]:
        _judge(verdict, reactions, _TENSION_HIGH, i, tension, lim["tension_max_N"])
    if slack_allowed:
        past["low_armed"] = past["slack_armed"] = 0.0
        return
    if not tension < lim["tension_min_N"]:
        past["low_s"] = past["slack_s"] = 0.0
        past["tight_rad"] = position
        if tension >= lim["tension_min_N"]:
            past["low_armed"] = past["slack_armed"] = 1.0
        return
    past["low_s"] += elapsed
    past["slack_s"] = past["slack_s"] + elapsed if tension < lim["slack_N"] else 0.0
    paid_out = (position - past["tight_rad"]) * cable_m_per_rad
    at_once = past["low_s"] <= lim["broken_within_s"] and paid_out < _PAID_OUT_m
    # each is told once, so that the cable can be tightened, and again when it was tight
    if past["slack_armed"] and past["slack_s"] > 0.0 and at_once:
        past["low_armed"] = past["slack_armed"] = 0.0
        _judge(verdict, reactions, _BROKEN_CABLE, i, tension, lim["tension_min_N"])
    elif past["slack_armed"] and past["slack_s"] > lim["slack_s"]:
        past["low_armed"] = past["slack_armed"] = 0.0
        _judge(verdict, reactions, _SLACK, i, tension, lim["slack_N"])
    elif past["low_armed"] and past["low_s"] > lim["slack_s"]:
        past["low_armed"] = 0.0
        _judge(verdict, reactions, _TENSION_LOW, i, tension, lim["tension_min_N"])


@jit
def _check(
    limits: Any,
    past: Any,
    window: Any,
    reactions: Any,
    verdict: Any,
    position: FloatArray,
    wanted: FloatArray,
    wanted_velocity: FloatArray,
    valid: BoolArray,
    alive: BoolArray,
    rate_ok: BoolArray,
    velocity: FloatArray,
    cable_m_per_rad: FloatArray,
    length: FloatArray,
    tension: FloatArray,
    sensor_ok: BoolArray,
    torque: FloatArray,
    elapsed: float,
    slack_allowed: bool,
) -> int:
    verdict[0]["reaction"] = verdict[0]["limit"] = 0
    period = limits[0]["period_s"]
    if elapsed - period > limits[0]["late_s"]:
        _judge(verdict, reactions, _LATE, -1, elapsed - period, limits[0]["late_s"])
    for i in range(torque.size):
        lim, own = limits[i], past[i]
        _bound_torque(i, lim, own, reactions, verdict, period, torque)
        fair = alive[i] and rate_ok[i]
        _watch_answers(i, lim, own, reactions, verdict, valid[i], fair, window)
        if not valid[i]:
            own["invalid_s"] += elapsed
            continue
        _watch_jumps(i, lim, own, reactions, verdict, elapsed, position[i])
        winding_in = -velocity[i] * np.sign(cable_m_per_rad[i])
        before = own["mean_N"]
        if _has_snapped(lim, own, elapsed, tension[i], winding_in):
            _judge(verdict, reactions, _BROKEN_CABLE, i, tension[i], before)
        error, paying_out = wanted[i] - position[i], wanted_velocity[i] * cable_m_per_rad[i]
        _watch_motion(i, lim, reactions, verdict, error, velocity[i], length[i], paying_out)
        if not sensor_ok[i]:
            # what takes its place is an estimate, whose step would look like a broken cable
            _judge(verdict, reactions, _TENSION_SENSOR, i, np.nan, np.nan)
            continue
        per_rad = cable_m_per_rad[i]
        _watch_tension(
            i, lim, own, reactions, verdict, elapsed, tension[i], slack_allowed, position[i],
            per_rad,
        )  # fmt: skip
    return int(verdict[0]["reaction"])


class Supervisor:
    """Clamps torque and says what must be done about the worst of what is exceeded.

    It latches nothing: whoever runs the cycle acts. `names` are what messages call the axes.
    """

    def __init__(self, limits: Limits, n: int, period_s: float, names: Sequence[str] = ()) -> None:
        self.limits = limits
        self._names = tuple(names) or tuple(f"axis {i + 1}" for i in range(n))
        self._limits = np.zeros(n, _LIMITS)
        for name in _FIGURES:
            self._limits[name] = getattr(limits, name)
        self._limits["period_s"] = period_s
        wanted = DEFAULT_REACTIONS | dict(limits.reactions)
        self._reactions = np.array([wanted.get(limit, 0) for limit in Limit], np.int64)
        self._past = np.zeros(n, _PAST)
        self._window = np.zeros((limits.window_cycles, n), np.int64)
        self._verdict = np.zeros(1, _VERDICT)
        self._told = ""
        self._disagree_s = 0.0
        self._judged: tuple[Any, Any, Any, Any] = (None,) * 4
        """Whose arrays the kernel is bound to."""
        self._check: Callable[..., int] = _check

    def reset(self, torque_Nm: FloatArray | float = 0.0) -> None:
        """Forget the past, before motors are driven; `torque_Nm` is what they are driven with."""
        self._past[:] = np.zeros(1, _PAST)
        self._past["torque"] = torque_Nm
        self._window[:] = 0
        self._verdict[:] = np.zeros(1, _VERDICT)
        self._told = ""
        self._disagree_s = 0.0

    def check(
        self,
        feedback: AxisFeedback,
        estimate: AxisEstimate,
        setpoint: Setpoint,
        torque_Nm: FloatArray,
    ) -> int:
        """Clamp `torque_Nm` (n,) in place; return the `Reaction` that this cycle calls for.

        The arrays of all four are those of the last call as long as the objects are.
        """
        self._told = ""
        judged = self._judged
        if (
            feedback is not judged[0]
            or estimate is not judged[1]
            or setpoint is not judged[2]
            or torque_Nm is not judged[3]
        ):
            self._bind(feedback, estimate, setpoint, torque_Nm)
        return self._check(estimate.elapsed_s, estimate.slack_allowed)

    def _bind(
        self,
        feedback: AxisFeedback,
        estimate: AxisEstimate,
        setpoint: Setpoint,
        torque_Nm: FloatArray,
    ) -> None:
        self._judged = feedback, estimate, setpoint, torque_Nm
        self._check = bound(
            _check,
            self._limits,
            self._past,
            self._window,
            self._reactions,
            self._verdict,
            feedback.position_rad,
            setpoint.position_rad,
            setpoint.velocity_rad_s,
            feedback.valid,
            feedback.alive,
            feedback.rate_ok,
            estimate.velocity_rad_s,
            estimate.cable_m_per_rad,
            estimate.cable_length_m,
            estimate.tension_N,
            estimate.sensor_ok,
            torque_Nm,
            then=(0.0, False),
        )

    def compare_lengths(self, elapsed_s: float, disagree_m: float, axis: int) -> int:
        """Judge by how much cable lengths contradict each other; return the `Reaction` so far.

        `elapsed_s` is the time since the last cycle; `axis` that of the cable which contradicts the
        others, -1 where it is not known. It counts once they have disagreed for `broken_within_s`
        longer than they agreed in between: that a cable has broken is told as such, and what
        swings about agreement is noticed.
        """
        allowed = self.limits.lengths_disagree_m
        agree = disagree_m <= allowed
        self._disagree_s = max(self._disagree_s + (-elapsed_s if agree else elapsed_s), 0.0)
        if self._disagree_s > self.limits.broken_within_s:
            _judge(self._verdict, self._reactions, int(Limit.LENGTHS), axis, disagree_m, allowed)
        return int(self._verdict["reaction"][0])

    def report(self, limit: Limit, reason: str) -> int:
        """Take in what another found, such as a drive's alarm; return the `Reaction` to it.

        It counts until the next `check`, and beside what that one found only if it is worse.
        """
        reaction = int(self._reactions[limit])
        if reaction > self._verdict["reaction"][0]:
            self._verdict[0] = (reaction, limit, -1, math.nan, math.nan)
            self._told = reason
        return int(self._verdict["reaction"][0])

    @property
    def reaction(self) -> Reaction:
        """What the last cycle called for."""
        return Reaction(int(self._verdict["reaction"][0]))

    @property
    def limit(self) -> Limit:
        """What was exceeded, NONE where nothing was."""
        return Limit(int(self._verdict["limit"][0]))

    @property
    def axis(self) -> int:
        """Which axis exceeded it, -1 where it is of none alone."""
        return int(self._verdict["axis"][0]) if self.limit else -1

    @property
    def value(self) -> float:
        """What it was, in the SI unit `unit`; nan where it has no value."""
        return float(self._verdict["value"][0])

    @property
    def allowed(self) -> float:
        """What it may be."""
        return float(self._verdict["allowed"][0])

    def reason(self) -> str:
        """Return what was exceeded, by which axis and how far, or an empty text."""
        limit = self.limit
        if self._told or not limit:
            return self._told
        text = limit.text.format(limit.factor * self.value, limit.factor * self.allowed)
        return text if self.axis < 0 else f"{self._names[self.axis]}: {text}"

    def details(self) -> dict[str, Any] | None:
        """Return the same for a program, None where nothing was exceeded."""
        limit = self.limit
        if not limit:
            return None
        figures = [x if math.isfinite(x) else None for x in (self.value, self.allowed)]
        return {
            "limit": limit.key,
            "axis": self.axis,
            "value": figures[0],
            "allowed": figures[1],
            "unit": limit.unit,
            "reaction": self.reaction.label,
        }
