"""Supervisor between controller and drives: every limit, and the reaction to it."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Final, NamedTuple

import numpy as np

from cdpr_profiles.robot_limits import Limit, Reactions
from cdpr_rt.arrays import BoolArray, FloatArray
from cdpr_rt.core.estimate import AxisEstimate
from cdpr_rt.core.exchange import AxisFeedback, Setpoint
from cdpr_rt.core.fault import PEAK, Fault
from cdpr_rt.core.states import Reaction
from cdpr_rt.jit import bound, bound_to, jit

# Limits of a supervisor, and the reaction to each.

POSE_UNRELIABLE: Final = frozenset(limit for limit in Limit if limit.unreliable)
"""Limits that, if exceeded, show that a platform's pose is unreliable or a winch does not
respond."""

LENGTHS_UNRELIABLE: Final = frozenset(limit for limit in Limit if limit.unreliable == "lengths")
"""Limits that, if exceeded, also make the cable lengths unknown."""


def reactions_of(named: Reactions, lowers: bool = False) -> dict[Limit, Reaction]:
    """Return the reaction to each limit according to a robot's file.

    If the platform can be lowered, controlled stops replace the quick stops that its file does not
    request: the winches that still work lower it.
    """
    by_label = {reaction.label: reaction for reaction in Reaction}
    wanted = {limit: by_label[getattr(named, limit.key)] for limit in Limit if limit}
    if lowers:
        for limit in POSE_UNRELIABLE:
            if limit.key not in named.model_fields_set:
                wanted[limit] = Reaction.CONTROLLED_STOP
    return wanted


DEFAULT_REACTIONS: Final = reactions_of(Reactions())

Bound = float | FloatArray


@dataclass(frozen=True)
class Limits:
    """Limits of the axes: one value for all, or one for each (n,).

    Omitted limits are not checked; `RobotLimits` has the defaults of robots.
    """

    torque_Nm: Bound
    """Limit to which the torque is clamped."""
    speed_rad_s: Bound
    following_error_rad: Bound
    missed_cycles: int
    """Consecutive cycles without an answer that are tolerated."""
    torque_rate_Nm_s: Bound = math.inf
    cable_length_min_m: Bound = -math.inf
    cable_length_max_m: Bound = math.inf
    tension_min_N: Bound = -math.inf
    tension_max_N: Bound = math.inf
    slack_N: Bound = -math.inf
    slack_s: float = math.inf
    """Longest time for which a tension may be below `tension_min_N`, and below `slack_N`."""
    broken_within_s: float = 0.0
    """A cable whose tension drops from `tension_min_N` to below `slack_N` faster than this counts
    as broken."""
    runaway_m_s: float = math.inf
    """A cable without tension counts as broken if its winch winds in this much faster than its
    set-point."""
    missed_in_window: int = 1 << 30
    window_cycles: int = 1
    stale_cycles: int = 1 << 30
    """Number of cycles for which a drive may not answer, or may answer irregularly."""
    lengths_disagree_m: float = math.inf
    """Largest normalised residual of a platform's cable lengths."""
    lengths_jump_m: float = math.inf
    """Largest change of a residual within some 0.2 s."""
    late_s: float = math.inf
    """Longest allowed delay of the loop itself."""
    reactions: Mapping[Limit, Reaction] = field(default_factory=dict)
    """Reactions that differ from `DEFAULT_REACTIONS`."""


# The check of every limit in a cycle, as a kernel over the axes.

# kernels take plain numbers
_TORQUE, _TORQUE_RATE = int(Limit.TORQUE), int(Limit.TORQUE_RATE)
_SPEED, _FOLLOWING_ERROR = int(Limit.SPEED), int(Limit.FOLLOWING_ERROR)
_CABLE_LENGTH, _TENSION_SENSOR = int(Limit.CABLE_LENGTH), int(Limit.TENSION_SENSOR)
_TENSION_LOW, _TENSION_HIGH = int(Limit.TENSION_LOW), int(Limit.TENSION_HIGH)
_SLACK, _BROKEN_CABLE = int(Limit.SLACK), int(Limit.BROKEN_CABLE)
_STALE, _LATE, _NOT_FINITE = int(Limit.STALE), int(Limit.LATE), int(Limit.NOT_FINITE)
_MISSED, _MISSED_IN_WINDOW = int(Limit.MISSED), int(Limit.MISSED_IN_WINDOW)
_ENCODER_JUMP = int(Limit.ENCODER_JUMP)

FIGURES: Final = tuple(name for name in Limits.__dataclass_fields__ if name != "reactions")
"""Attributes of `Limits` that are numbers."""
AXIS_LIMITS: Final = np.dtype([(name, "<f8") for name in (*FIGURES, "period_s")])
AXIS_HISTORY: Final = np.dtype(
    [
        ("torque", "<f8"),  # torque passed to the drives in the last cycle
        ("missed", "<f8"),  # consecutive
        ("in_window", "<f8"),
        ("window_index", "<i8"),  # index of the last cycle in the window
        ("stale", "<f8"),
        ("low_s", "<f8"),  # time since the tension was last sufficient
        ("slack_s", "<f8"),
        ("tight_rad", "<f8"),  # motor angle at that time
        ("low_armed", "<f8"),  # whether it was sufficient since enabling, or since the last report
        ("slack_armed", "<f8"),
        ("mean_N", "<f8"),  # tension, low-passed while the winch does not wind in fast
        ("valid_count", "<f8"),  # valid angles since enabling, up to 2
        ("valid_rad", "<f8"),  # the last valid angle
        ("velocity_rad_s", "<f8"),  # velocity at that time
        ("invalid_s", "<f8"),  # time since the last valid angle
        ("runs_in_m_s", "<f8"),  # speed beyond the set-point's, low-passed
        ("jumped_s", "<f8"),  # time for which a jump of the angle still affects speeds
        ("peak_N", "<f8"),  # the highest lightly filtered tension above its limit, 0 for none
    ]
)
VERDICT: Final = np.dtype(
    [("reaction", "<i8"), ("limit", "<i8"), ("axis", "<i8"), ("value", "<f8"), ("allowed", "<f8")]
)


class Signals(NamedTuple):
    """Signals of one cycle to be checked, (n,), named as in the objects that contain them."""

    position: FloatArray
    """This and the following signals up to `rate_ok` come from `AxisFeedback`."""
    valid: BoolArray
    alive: BoolArray
    rate_ok: BoolArray
    setpoint: FloatArray
    """From `Setpoint`."""
    setpoint_velocity: FloatArray
    velocity: FloatArray
    """This and the following signals up to `sensor_ok` come from `AxisEstimate`."""
    cable_m_per_rad: FloatArray
    length: FloatArray
    tension: FloatArray
    tension_at_once: FloatArray
    sensor_ok: BoolArray


_JUMP_rad: Final = 0.05
"""Allowed distance of an angle from its extrapolation, besides what the speed limit allows."""
_JUMPS_S: Final = 0.01
"""Time for which a jump of an angle affects speeds."""
_SNAPPED_SHARE, _MEAN_S = 0.6, 0.1
"""A cable whose winch winds in fast counts as broken if its tension is below this share of the mean
over this time."""
_SUDDEN_m_s, _SUDDEN_S = 0.35, 0.05
"""Increase of the winding-in speed, over this time, by which a broken cable is detected during
blind lowering. A winch that winds in the slack of a swinging platform reached 0.34 m/s."""
_PAID_OUT_m: Final = 5e-4
"""A cable does not count as broken if this much was paid out while its tension fell."""


@jit
def _exceeded(worst: Any, limit: int, axis: int, value: float, allowed: float) -> None:
    """Keep the most severe exceeded limit, of all axes and of this axis; if equal, the first."""
    verdicts, reactions = worst
    for row in (0, 1 + axis):
        verdict = verdicts[row]
        if reactions[limit] > verdict["reaction"]:
            verdict["reaction"], verdict["limit"] = reactions[limit], limit
            verdict["axis"], verdict["value"], verdict["allowed"] = axis, value, allowed


@jit
def _bound_torque(
    i: int, limits: Any, history: Any, worst: Any, period: float, torque: FloatArray
) -> None:
    asked = torque[i]
    if not np.isfinite(asked):
        _exceeded(worst, _NOT_FINITE, i, asked, 0.0)
        asked = 0.0
    bound, rate = limits["torque_Nm"], limits["torque_rate_Nm_s"]
    if abs(asked) > bound:
        _exceeded(worst, _TORQUE, i, asked, bound)
        asked = min(max(asked, -bound), bound)
    step = asked - history["torque"]
    if abs(step) > rate * period:
        _exceeded(worst, _TORQUE_RATE, i, step / period, rate)
        asked = history["torque"] + min(max(step, -rate * period), rate * period)
    history["torque"] = torque[i] = asked


@jit
def _watch_answers(
    i: int, limits: Any, history: Any, worst: Any, valid: bool, regular: bool, window: Any
) -> None:
    missed = 0 if valid else 1
    # this cycle's flag replaces that of one window ago
    history["window_index"] = index = (history["window_index"] + 1) % window.shape[0]
    history["missed"] = 0.0 if valid else history["missed"] + 1.0
    history["in_window"] += missed - window[index, i]
    window[index, i] = missed
    history["stale"] = 0.0 if regular else history["stale"] + 1.0
    if history["missed"] > limits["missed_cycles"]:
        _exceeded(worst, _MISSED, i, history["missed"], limits["missed_cycles"])
    if history["in_window"] > limits["missed_in_window"]:
        _exceeded(worst, _MISSED_IN_WINDOW, i, history["in_window"], limits["missed_in_window"])
    if history["stale"] > limits["stale_cycles"]:
        _exceeded(worst, _STALE, i, history["stale"], limits["stale_cycles"])


@jit
def _watch_jumps(
    i: int, limits: Any, history: Any, worst: Any, elapsed: float, position: float
) -> None:
    history["invalid_s"] += elapsed
    step = position - history["valid_rad"]
    jump = step - history["velocity_rad_s"] * history["invalid_s"]
    possible = limits["speed_rad_s"] * history["invalid_s"] + _JUMP_rad
    if history["valid_count"] == 2.0 and abs(jump) > possible:
        _exceeded(worst, _ENCODER_JUMP, i, jump, possible)
        history["jumped_s"] = _JUMPS_S
    history["velocity_rad_s"] = step / history["invalid_s"] if history["valid_count"] else 0.0
    history["valid_count"] = min(history["valid_count"] + 1.0, 2.0)
    history["valid_rad"], history["invalid_s"] = position, 0.0


@jit
def _watch_motion(
    i: int, limits: Any, worst: Any, error: float, velocity: float, length: float, paying_out: float
) -> None:
    # nan also counts as outside its limit
    if not abs(velocity) <= limits["speed_rad_s"]:
        _exceeded(worst, _SPEED, i, velocity, limits["speed_rad_s"])
    if not abs(error) <= limits["following_error_rad"]:
        _exceeded(worst, _FOLLOWING_ERROR, i, error, limits["following_error_rad"])
    # beyond a maximum length only winding in is allowed
    if length > limits["cable_length_max_m"] and paying_out > 0.0:
        _exceeded(worst, _CABLE_LENGTH, i, length, limits["cable_length_max_m"])
    if length < limits["cable_length_min_m"] and paying_out < 0.0:
        _exceeded(worst, _CABLE_LENGTH, i, length, limits["cable_length_min_m"])


@jit
def _has_snapped(
    history: Any,
    elapsed: float,
    tension: float,
    runaway_m_s: float,
    allowed_m_s: float,
    runs_away: bool,
) -> bool:
    """Whether a cable that was tight has lost its tension, so that its winch `runs_away`.

    The winch's friction may exceed `slack_N`, and remains in a tension estimated from torque.
    """
    before = history["mean_N"]
    # mean of the earlier tension: friction alone, before a winch turns, does not count
    if np.isfinite(tension) and not runaway_m_s > 0.25 * allowed_m_s:
        history["mean_N"] += elapsed / (elapsed + _MEAN_S) * (tension - before)
    return bool(runs_away and tension < _SNAPPED_SHARE * before)


@jit
def _watch_peak(limits: Any, history: Any, elapsed: float, tension: float) -> None:
    """Store the highest tension above its limit, except while a jump of the angle affects it."""
    history["jumped_s"] = max(history["jumped_s"] - elapsed, 0.0)
    if tension > limits["tension_max_N"] and history["jumped_s"] == 0.0:
        history["peak_N"] = max(history["peak_N"], tension)


@jit
def _watch_tension(
    i: int,
    limits: Any,
    history: Any,
    worst: Any,
    elapsed: float,
    tension: float,
    slack_allowed: bool,
    position: float,
    cable_m_per_rad: float,
) -> None:
    if tension > limits["tension_max_N"]:
        _exceeded(worst, _TENSION_HIGH, i, tension, limits["tension_max_N"])
    if slack_allowed:
        history["low_armed"] = history["slack_armed"] = 0.0
        return
    if not tension < limits["tension_min_N"]:
        history["low_s"] = history["slack_s"] = 0.0
        history["tight_rad"] = position
        if tension >= limits["tension_min_N"]:
            history["low_armed"] = history["slack_armed"] = 1.0
        return
    history["low_s"] += elapsed
    history["slack_s"] = history["slack_s"] + elapsed if tension < limits["slack_N"] else 0.0
    paid_out = (position - history["tight_rad"]) * cable_m_per_rad
    at_once = history["low_s"] <= limits["broken_within_s"] and paid_out < _PAID_OUT_m
    # reported once, so that the cable can be tightened, and again only after the cable was tight
    if history["slack_armed"] and history["slack_s"] > 0.0 and at_once:
        history["low_armed"] = history["slack_armed"] = 0.0
        _exceeded(worst, _BROKEN_CABLE, i, tension, limits["tension_min_N"])
    elif history["slack_armed"] and history["slack_s"] > limits["slack_s"]:
        history["low_armed"] = history["slack_armed"] = 0.0
        _exceeded(worst, _SLACK, i, tension, limits["slack_N"])
    elif history["low_armed"] and history["low_s"] > limits["slack_s"]:
        history["low_armed"] = 0.0
        _exceeded(worst, _TENSION_LOW, i, tension, limits["tension_min_N"])


@jit
def check_axes(
    all_limits: Any,
    histories: Any,
    window: Any,
    reactions: Any,
    verdicts: Any,
    signals: Signals,
    torque: FloatArray,
    elapsed: float,
    slack_allowed: bool,
    paying_out_blind: bool,
) -> int:
    """Check one cycle of n axes and clamp `torque` (n,) in place; return the reaction.

    `all_limits`, `histories` (n,) and `verdicts` (1 + n,), of all axes and of each, are records of
    `AXIS_LIMITS`, `AXIS_HISTORY` and `VERDICT`; `window` (m, n) marks missed answers of the last m
    cycles, `reactions` has the reaction to each `Limit`; `elapsed` is from the last SYNC to this
    one, s. `paying_out_blind` is whether the winches lower a platform without its pose.
    """
    for i in range(verdicts.size):
        verdicts[i]["reaction"] = verdicts[i]["limit"] = 0
    worst = verdicts, reactions
    period = all_limits[0]["period_s"]
    if elapsed - period > all_limits[0]["late_s"]:
        _exceeded(worst, _LATE, -1, elapsed - period, all_limits[0]["late_s"])
    for i in range(torque.size):
        limits, history = all_limits[i], histories[i]
        cable_m_per_rad = signals.cable_m_per_rad[i]
        paying_out = signals.setpoint_velocity[i] * cable_m_per_rad
        if signals.valid[i]:
            _watch_jumps(i, limits, history, worst, elapsed, signals.position[i])
        _bound_torque(i, limits, history, worst, period, torque)
        regular = signals.alive[i] and signals.rate_ok[i]
        _watch_answers(i, limits, history, worst, signals.valid[i], regular, window)
        if not signals.valid[i]:
            history["invalid_s"] += elapsed
            continue
        position, velocity = signals.position[i], signals.velocity[i]
        tension = signals.tension[i]
        _watch_peak(limits, history, elapsed, signals.tension_at_once[i])
        mean_N, runaway_m_s = history["mean_N"], paying_out - velocity * cable_m_per_rad
        too_fast = -velocity * np.sign(cable_m_per_rad) > limits["speed_rad_s"]
        armed, allowed_m_s = history["slack_armed"] != 0.0, limits["runaway_m_s"]
        history["runs_in_m_s"] += (
            elapsed / (elapsed + _SUDDEN_S) * (runaway_m_s - history["runs_in_m_s"])
        )
        if paying_out_blind:
            least_N, allowed_m_s = limits["tension_min_N"], _SUDDEN_m_s
            armed = tension < least_N < mean_N
            too_fast |= runaway_m_s - history["runs_in_m_s"] > allowed_m_s
        else:
            too_fast |= runaway_m_s > allowed_m_s
        if _has_snapped(history, elapsed, tension, runaway_m_s, allowed_m_s, armed and too_fast):
            _exceeded(worst, _BROKEN_CABLE, i, tension, mean_N)
        error = signals.setpoint[i] - position
        _watch_motion(i, limits, worst, error, velocity, signals.length[i], paying_out)
        if not signals.sensor_ok[i]:
            # the estimate replaces the reading, and the step would look like a broken cable
            _exceeded(worst, _TENSION_SENSOR, i, np.nan, np.nan)
            continue
        _watch_tension(
            i, limits, history, worst, elapsed, tension, slack_allowed, position, cable_m_per_rad
        )
    return int(verdicts[0]["reaction"])


Suspects = Callable[[bool], Sequence[int]]
"""Function that returns the axes whose cables may contradict the others, the most likely first. If
its argument is true, it uses sudden changes of the residuals."""


def no_suspects(_jump: bool) -> Sequence[int]:
    """Return no axes, because nothing is known about them."""
    return ()


class Supervisor:
    """Clamps torque and returns the reaction to the most severe of the exceeded limits.

    It does not latch: its caller must act.
    """

    def __init__(self, limits: Limits, n: int, period_s: float) -> None:
        self.limits = limits
        self._limits = np.zeros(n, AXIS_LIMITS)
        for name in FIGURES:
            self._limits[name] = getattr(limits, name)
        self._limits["period_s"] = period_s
        reactions = DEFAULT_REACTIONS | dict(limits.reactions)
        self._reactions = np.array([reactions.get(limit, 0) for limit in Limit], np.int64)
        self._history = np.zeros(n, AXIS_HISTORY)
        self._window = np.zeros((limits.window_cycles, n), np.int64)
        self._verdicts = np.zeros(1 + n, VERDICT)
        self._verdict = self._verdicts[:1]
        self._reported: dict[int, Fault] = {}
        """Faults of this cycle from `report`, by row of `_verdicts`."""
        self._of_no_axis: dict[Limit, Fault] = {}
        """Faults of this cycle that end a motion and belong to no single axis."""
        self._disagree_s = 0.0
        self._suspects: tuple[int, ...] | None = None
        """Axes whose lengths may be wrong, from the first disagreement until lengths agree
        again."""
        self._kernel = bound_to(self._bind)

    def reset(self, torque_Nm: FloatArray | float = 0.0) -> None:
        """Discard the history before motors are driven; `torque_Nm` is their first torque."""
        self._history[:] = np.zeros(1, AXIS_HISTORY)
        self._history["torque"] = torque_Nm
        self._window[:] = 0
        self._verdicts[:] = np.zeros(1, VERDICT)
        self._reported.clear()
        self._of_no_axis.clear()
        self._suspects = None
        self._disagree_s = 0.0

    def check(
        self,
        feedback: AxisFeedback,
        estimate: AxisEstimate,
        setpoint: Setpoint,
        torque_Nm: FloatArray,
        paying_out_blind: bool = False,
    ) -> int:
        """Clamp `torque_Nm` (n,) in place; return the `Reaction` that this cycle requires.

        The arrays are bound again only if one of the four objects has been replaced. With
        `paying_out_blind`, the winches lower a platform without its pose: cables may become slack,
        and a broken cable is detected only by the speed of its winch.
        """
        self._reported.clear()
        self._of_no_axis.clear()
        check = self._kernel(feedback, estimate, setpoint, torque_Nm)
        return check(estimate.elapsed_s, estimate.slack_allowed, paying_out_blind)

    def _bind(
        self,
        feedback: AxisFeedback,
        estimate: AxisEstimate,
        setpoint: Setpoint,
        torque_Nm: FloatArray,
    ) -> Callable[[float, bool, bool], int]:
        return bound(
            check_axes, self._limits, self._history, self._window, self._reactions, self._verdicts,
            Signals(
                feedback.position_rad, feedback.valid, feedback.alive, feedback.rate_ok,
                setpoint.position_rad, setpoint.velocity_rad_s, estimate.velocity_rad_s,
                estimate.cable_m_per_rad, estimate.cable_length_m, estimate.tension_N,
                estimate.tension_at_once_N, estimate.sensor_ok,
            ),
            torque_Nm, then=(0.0, False, False),
        )  # fmt: skip

    def compare_lengths(
        self,
        elapsed_s: float,
        disagree_m: float,
        axis: int,
        suspects: Suspects = no_suspects,
        jump_m: float = 0.0,
        jumped: int = -1,
    ) -> int:
        """Check how much cable lengths contradict each other; return the `Reaction` so far.

        `elapsed_s` is the time since the last cycle. `axis` is the axis of the cable that
        contradicts the others, -1 if it is not known. In that case `suspects` returns the possible
        axes, the most likely first. It is called once, when the limit is exceeded. `jump_m` is the
        largest sudden change of a residual, and `jumped` the cable of that residual, -1 if it is
        not known.

        A disagreement is a fault when it has lasted `broken_within_s` longer than the agreement in
        between. So a broken cable is first detected by its tension, and lengths that oscillate
        about the limit are also detected.
        """
        limit, allowed = Limit.LENGTHS, self.limits.lengths_disagree_m
        agree = disagree_m <= allowed
        if agree and jump_m > self.limits.lengths_jump_m:
            limit, allowed = Limit.LENGTHS_JUMP, self.limits.lengths_jump_m
            agree, axis, disagree_m = False, jumped, jump_m
        self._disagree_s = max(self._disagree_s + (-elapsed_s if agree else elapsed_s), 0.0)
        if self._disagree_s > self.limits.broken_within_s:
            if axis < 0 and self._suspects is None:
                found = suspects(limit is Limit.LENGTHS_JUMP)
                self._suspects = tuple(int(i) for i in found)
            likely = self._suspects or () if axis < 0 else ()
            return self.report(
                Fault(limit, axis, value=disagree_m, allowed=allowed, suspects=likely)
            )
        self._suspects = None
        return int(self._verdict["reaction"][0])

    def report(self, fault: Fault) -> int:
        """Process a fault that another part found, such as a drive's alarm; return the `Reaction`.

        It is valid until the next `check`, and only used if it is more severe than the faults of
        this cycle.
        """
        reaction, worst = int(self._reactions[fault.limit]), int(self._verdict["reaction"][0])
        verdict = (reaction, fault.limit, fault.axis, fault.value, fault.allowed)
        if fault.axis >= 0 and reaction > self._verdicts["reaction"][1 + fault.axis]:
            self._verdicts[1 + fault.axis] = verdict
            self._reported[1 + fault.axis] = fault
        for found in (self.fault(), fault):
            if found and found.axis < 0 and self._reactions[found.limit] > Reaction.HOLD:
                self._of_no_axis.setdefault(found.limit, found)
        if reaction > worst:
            self._verdict[0] = verdict
            self._reported[0] = fault
        return max(reaction, worst)

    def findings(self) -> Iterator[Fault]:
        """Yield the faults that end a motion: those of no single axis, and the worst of each
        axis.
        """
        yield from self._of_no_axis.values()
        for row in np.flatnonzero(self._verdicts["reaction"] > Reaction.HOLD).tolist():
            if int(self._verdicts["axis"][row]) == row - 1 and (
                row > 0 or self.limit not in self._of_no_axis
            ):
                yield self._fault(row)

    def peaks(self) -> list[Fault]:
        """Return faults of cables that exceeded their highest tension since power-on, even briefly.

        A short peak of tension may end before its filtered value exceeds the limit.
        """
        peak_N, most_N = self._history["peak_N"], self._limits["tension_max_N"]
        return [
            Fault(Limit.TENSION_HIGH, i, PEAK, value=float(peak_N[i]), allowed=float(most_N[i]))
            for i in np.flatnonzero(peak_N).tolist()
        ]

    @property
    def reaction(self) -> Reaction:
        """Reaction of the last cycle."""
        return Reaction(int(self._verdict["reaction"][0]))

    @property
    def limit(self) -> Limit:
        """Exceeded limit, or NONE."""
        return Limit(int(self._verdict["limit"][0]))

    @property
    def axis(self) -> int:
        """Axis that exceeded the limit, -1 if there is no single axis."""
        return int(self._verdict["axis"][0]) if self.limit else -1

    def fault(self) -> Fault | None:
        """Return the most severe fault of this cycle, None if no limit was exceeded."""
        return self._fault(0) if self.limit else None

    def _fault(self, row: int) -> Fault:
        if reported := self._reported.get(row):
            return reported
        _, number, axis, value, allowed = self._verdicts[row].item()
        return Fault(Limit(number), axis, value=value, allowed=allowed)
