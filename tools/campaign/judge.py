"""Judge what a robot did in a scenario, by the truth and by what the robot reported."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Any, Final

import numpy as np

from cdpr_profiles import Robot, load_robot
from cdpr_rt.arrays import BoolArray, FloatArray
from cdpr_rt.diagnosis.predictions import Loss, Swing, corner_swings, slips
from cdpr_rt.diagnosis.subject import Subject
from cdpr_rt.model.robot_arrays import limits_of
from cdpr_sim_bus.cia402.faults import FAULTS
from cdpr_tools.campaign.play import Played
from cdpr_tools.campaign.scenario import BEFORE_BOOT

_TORQUE_Nm: Final = 1e-3
_DEAD_WITHIN_S: Final = 3.0
"""Longest time from the death of the master until the drives have no power.

Drives that do not detect standstill end a quick stop after 2 s.
"""
_FELL_m: Final = 0.05
_FALLS_m: Final = 0.005
_RELEASED_S: Final = 0.5
"""Longest time from a release of a platform until it has come down 5 mm."""
_CARRIED_S: Final = 0.1
_OVER: Final = 1.25
_RISE_MB: Final = 150.0


@dataclass
class Result:
    """The outcome of one seed, as data."""

    seed: int
    robot: str
    violations: list[str] = field(default_factory=list)
    faults: list[tuple[str, str]] = field(default_factory=list)
    """Each fault that was injected, and what became of it."""
    digest: str = ""
    cpu_s: float = 0.0
    """Processor time, including the seed's share of the start of its robot."""
    bus_s: float = 0.0
    notes: list[str] = field(default_factory=list)


@dataclass(frozen=True)
class Predicted:
    """What `cdpr robot show` predicts, with a margin."""

    fastest_m_s: list[float]
    """Downward speed after the loss of each cable or drive, or of the lengths."""
    aside_m: list[float]
    """Horizontal way after the same losses."""
    subject: Subject
    peak_N: FloatArray
    """Tension of each cable after a slip, or at the full torque of its motor."""
    off_m: FloatArray
    """Error of the platform's position by an unnoticed slip of each cable."""


@lru_cache(maxsize=1)
def predicted(robot: str) -> Predicted:
    """Return what is predicted for a robot, by its name or file."""
    s = Subject(load_robot(robot))
    swings = {loss: corner_swings(s, loss) for loss in Loss}

    def worst(i: int, figure: Callable[[Swing], float]) -> float:
        found = [*swings[Loss.CABLE][i], *swings[Loss.DRIVE][i], *swings[Loss.LENGTHS][0]]
        return _OVER * max(map(figure, found), default=math.inf)

    slipped = slips(s)
    return Predicted(
        [worst(i, lambda swing: swing.fastest_m_s) + s.platform.speed_m_s for i in range(s.n)],
        [worst(i, lambda swing: swing.aside_m) for i in range(s.n)],
        s,
        *(_OVER * np.array([getattr(slip, name) for slip in slipped])
          for name in ("peak_N", "off_m")),
    )  # fmt: skip


class Judge:
    """What a judge derives from a played scenario."""

    def __init__(self, played: Played, robot: Robot) -> None:
        self.played, self.robot = played, robot
        self.limits = limits_of(robot)
        self.truth, self.n = played.truth, len(robot.axes)
        self.end = played.statuses[-1] if played.statuses else {}
        faults = played.scenario.faults
        self.causes = [Cause(one, faults, played.began_s) for one in faults if one["value"] != 0]

    @property
    def disturbed_s(self) -> float:
        """Bus time of the first fault, stall or loss of power, infinite without one.

        A cable that relaxes accelerates the rotor of a motor without torque.
        """
        begun_s = self.played.began_s
        times = [begun_s + fault["at_s"] for fault in self.played.scenario.faults]
        ends = ("stall", "die", "power off")
        times += [at_s for name, at_s in self.played.done if name in ends]
        return min(times, default=math.inf)

    def named(self) -> Iterator[tuple[dict[str, Any], float, bool]]:
        """Yield each fault that the robot named: its record, its time, and whether as the cause."""
        seen = set()
        for status in self.played.statuses:
            for i, fault in enumerate(status["faults"] or ()):
                key = fault["limit"], fault["axis"], fault["code"]
                if key not in seen:
                    seen.add(key)
                    yield fault, status["at_s"], i == 0

    def periods(self) -> Iterator[tuple[dict[str, Any], float]]:
        """Yield each status, and when the next one replaced it or the loop died."""
        played = self.played
        ends_s = [status["at_s"] for status in played.statuses[1:]] + [math.inf]
        for status, end_s in zip(played.statuses, ends_s, strict=True):
            yield status, end_s if played.dead_s is None else min(end_s, played.dead_s)

    def during(self, of: Callable[[dict[str, Any]], bool]) -> BoolArray:
        """Return for each record of the truth whether the status then fulfilled `of`."""
        chosen, time_s = np.zeros(self.truth.size, np.bool_), self.truth["time_s"]
        for status, end_s in self.periods():
            if status["state"] == "active" and of(status):
                chosen |= (time_s >= status["at_s"]) & (time_s < end_s)
        for name, at_s in self.played.done:  # the loop of the robot did not run
            if name in ("stall", "die"):
                chosen &= (time_s < at_s) | (time_s > at_s + _STALL_S)
        return chosen

    def works_at(self, at_s: float) -> bool:
        """Return whether the robot had power and no fault at a time."""
        then = [status for status in self.played.statuses if status["at_s"] <= at_s]
        return bool(then) and then[-1]["state"] == "active" and then[-1]["reacting"] == "none"

    def sure(self, cause: Cause) -> bool:
        """Return whether no running robot may miss a fault."""
        others = [
            other.at_s
            for other in self.causes
            if other is not cause and other.name not in (*_ON_THE_BUS, "frames-late")
        ]
        if cause.name in _SURE or any(abs(at_s - cause.at_s) < _ALONE_S for at_s in others):
            return cause.name in _SURE
        before = int(np.searchsorted(self.truth["time_s"], cause.at_s)) - 1
        if before < 0:
            return False
        pulled = (self.truth["tension_N"][before] / self.limits.tension_min_N).min()
        amount = FAULTS[cause.name].amount(cause.value)
        if cause.name == "slip":
            subject = predicted(self.played.scenario.robot).subject
            place = self.truth["position_m"][before, : subject.model.positions]
            sudden_m = slips(subject, [place])[cause.axis].sudden_m
            wide = 1e-3 * amount > _OVER * sudden_m
            return pulled > 1.0 and wide and not self._loose(cause.at_s, before)
        if cause.name == "encoder-jump":
            turns = abs(amount) / self.robot.axes[cause.axis].winch.encoder_counts_per_turn
            return turns * math.tau > _SURE_JUMP_rad
        if cause.name == "silence":
            tolerated_s = self.limits.missed_cycles * self.robot.sync_period_s
            return 1e-3 * amount > 2.0 * tolerated_s
        return cause.name == "cut-cable" and pulled > 2.0 and not self._loose(cause.at_s, before)

    def _loose(self, at_s: float, record: int) -> bool:
        """Return whether cables might be slack: on the stand, or while none counts as tight."""
        then = [status for status in self.played.statuses if status["at_s"] <= at_s]
        if not then:
            return True
        program, progress = then[-1]["program"], then[-1]["program_progress"] or {}
        if program in ("hold", "jog"):
            return progress.get("tight") is False
        platform = self.robot.platform
        assert platform is not None  # campaigns are for robots with a platform
        above_m = self.truth["position_m"][record, self.up] - platform.home_m[self.up]
        return program == "lower" and bool(above_m < _STANDS_m)

    def falls(self) -> list[Fall]:
        """Return when and how far the platform came down while no motor had torque."""
        found, time_s = [], self.truth["time_s"]
        powerless = (np.abs(self.truth["torque_Nm"]) <= _TORQUE_Nm).all(axis=1)
        for name, at_s in self.played.done:
            if name == "put-back":
                powerless[np.abs(time_s - at_s) < _CARRIED_S] = False
        edges = np.flatnonzero(np.diff(np.r_[False, powerless, False]))
        for first, end in edges.reshape(-1, 2):
            height_m = self.truth["position_m"][first:end, self.up]
            depth_m = float(height_m[0] - height_m.min())
            if depth_m > _FELL_m:
                begin = first + int(np.argmax(height_m < height_m[0] - _FALLS_m))
                off_s, end_s = time_s[first], time_s[end - 1]
                found.append(Fall(float(off_s), float(time_s[begin]), float(end_s), depth_m))
        return found

    def released(self, fall: Fall) -> bool:
        """Return whether a platform without power fell because something from outside changed."""
        times = [(cause.at_s, cause.end_s) for cause in self.causes if cause.name in _FROM_OUTSIDE]
        times += [(at_s, at_s) for name, at_s in self.played.done if name == "mend"]
        # a push that began under power must not make the robot drop its platform
        changes = [(a if a >= fall.off_s else b, b) for a, b in times if b >= fall.off_s]
        return any(a <= fall.began_s <= b + _RELEASED_S for a, b in changes)

    def winches_left(self, fall: Fall) -> int:
        """Return how many winches could lower the platform before it fell; all after one fault."""
        lost = {c.axis for c in self.causes if c.name in _LOSES and c.at_s < fall.off_s}
        return self.n - len(lost) if len(lost) > 1 else self.n

    @property
    def up(self) -> int:
        """Number of the coordinate that points upward."""
        return 1 if self.robot.platform is not None and self.robot.platform.is_planar else 2

    @property
    def ended(self) -> bool:
        """Whether the power may be off because of a user, or of a dead or stalled loop."""
        return any(name in ("power off", "stall", "die") for name, _ in self.played.done)


@dataclass(frozen=True)
class Fall:
    """A descent of the platform while no motor has torque; bus times."""

    off_s: float
    began_s: float
    end_s: float
    """When a motor has torque again, or the scenario ends."""
    depth_m: float

    def __str__(self) -> str:
        return f"the platform fell {1e3 * self.depth_m:.0f} mm at {self.began_s:.3f} s"


class Cause:
    """An injected fault."""

    def __init__(
        self, fault: dict[str, Any], all_faults: Sequence[dict[str, Any]], began_s: float
    ) -> None:
        self.name, self.axis = str(fault["fault"]), int(fault["axis"] or 0) - 1
        self.at_s, self.value = began_s + fault["at_s"], fault["value"]
        ends_s = [
            began_s + one["at_s"]
            for one in all_faults
            if one["fault"] == self.name and one["value"] == 0
        ]
        self.end_s = min((end_s for end_s in ends_s if end_s >= self.at_s), default=self.at_s)
        """End of a push."""

    def explains(self, named: dict[str, Any]) -> bool:
        """Return whether a fault that the robot named may follow from this one."""
        axis, limit, code = named["axis"], named["limit"], named["code"]
        if self.name not in _MAY_CAUSE.get(code, (self.name,)):
            return False
        if self.name in _WORDS_ONLY and limit != "drive":
            return False
        if axis in (self.axis, -1) or self.axis in named["suspects"] or self.name in _ANYWHERE:
            return True
        if self.name == "encoder-frozen" and limit == "following_error":
            return True  # its winch winds in without end, and drags the others from their places
        return limit in _PULLED and self.name not in _ON_THE_BUS


_GONE: Final = ("drive-off", "drive-reboot", "bus-off", "bus-lost", "silence")
_NOT_OPERATIONAL: Final = ("pre-operational", "nmt-stop", "duplicate-node")
_LOSES: Final = (
    *_GONE, *_NOT_OPERATIONAL, "drive-fault", "power-lost", "torque-stuck", "cut-cable",
)  # fmt: skip
"""Faults after which a winch cannot lower the platform."""
_ON_THE_BUS: Final = (
    "no-heartbeat", "heartbeat-late", "emcy", "emcy-flood", "frames-doubled", "index-missed",
)  # fmt: skip
_WORDS_ONLY: Final = ("no-heartbeat", "heartbeat-late", "emcy", "emcy-flood")
"""Faults that change neither motion nor answers to SYNC."""
_MAY_CAUSE: Final = {
    "silent": (*_GONE, *_NOT_OPERATIONAL, "frames-lost", "frames-lossy", "frames-late"),
    "unsteady": (*_GONE, "frames-lost", "frames-lossy", "frames-late"),
    "doubled": ("frames-doubled", "frames-late"),
    "no_heartbeat": (*_GONE, "no-heartbeat", "heartbeat-late"),
    "restarted": ("drive-reboot", "drive-off", "duplicate-node"),
    "not_operational": (*_GONE, *_NOT_OPERATIONAL),
    "flooding": ("emcy-flood",),
    "FF00h": ("emcy", "emcy-flood"),
    "7305h": ("drive-fault",),
}
"""Possible causes of each fault code; a code that is not listed may have any cause."""
_PULLED: Final = ("tension_high", "lengths", "lengths_jump", "slack", "broken_cable")
"""Limits that cables exceed because another cable pulls too much, or no longer."""
_FROM_OUTSIDE: Final = ("push-x", "push-y", "push-z", "obstacle", "payload")
_ANYWHERE: Final = (*_FROM_OUTSIDE, "bus-lost")
"""Faults that concern all axes."""
_DISOBEYS: Final = ("torque-bias", "torque-stuck")
"""Motors that drag a platform with their own power, to the cable's exit, where it is stiffest."""
_SURE: Final = (
    "drive-off", "drive-reboot", "drive-fault", "power-lost", "pre-operational", "nmt-stop",
    "bus-off", "bus-lost", "emcy-flood",
)  # fmt: skip
"""Faults that no running robot may miss."""
_NAMED_AS: Final = {
    "encoder-jump": ("encoder_jump",),
    "cut-cable": ("broken_cable", "lengths_jump"),
    "slip": ("broken_cable", "lengths", "lengths_jump"),
    "silence": ("missed", "stale", "drive"),
}
"""Limits by which some faults must be named.

The rotor of a cut cable runs in. With redundant cables, this contradicts the other lengths before
the measured torque falls. Then the suspects must contain the cable.
"""
_ALONE_S: Final = 0.5
_SURE_JUMP_rad: Final = 1.0
"""Jump of an encoder that no running robot may miss: more than a motor turns in some cycles."""


# The invariants. Each yields what was violated.

Invariant = Callable[[Judge], Iterator[str]]


def no_torque_afterwards(j: Judge) -> Iterator[str]:
    """A robot that reports no power has none: people go near it."""
    powered = np.abs(j.truth["torque_Nm"]) > _TORQUE_Nm
    for status, end_s in j.periods():
        if status["state"] not in _WITHOUT_POWER or status["busy"] or _unsure(status):
            continue
        time_s = j.truth["time_s"]
        here = (time_s > status["at_s"] + _OFF_WITHIN_S) & (time_s < end_s)
        for axis in np.flatnonzero(powered[here].any(axis=0)):
            yield f"axis {axis + 1} has torque in state {status['state']}: {status['reason']}"


_WITHOUT_POWER: Final = ("ready", "fault", "inactive", "unconfigured")
_OFF_WITHIN_S: Final = 0.05


def _unsure(status: dict[str, Any]) -> bool:
    """Return whether, by its status, a drive may have power or a reaction is not over yet."""
    unconfirmed = any(fault["code"].startswith("power_") for fault in status["faults"] or ())
    return unconfirmed or status["reacting"] != "none"


def dead_loop_has_no_torque(j: Judge) -> Iterator[str]:
    """Drives without a master must stop on their own: nobody else can stop them."""
    if j.played.dead_s is not None:
        late = j.truth[j.truth["time_s"] > j.played.dead_s + _DEAD_WITHIN_S]
        for axis in np.flatnonzero((np.abs(late["torque_Nm"]) > _TORQUE_Nm).any(axis=0)):
            yield f"axis {axis + 1} has torque {_DEAD_WITHIN_S:g} s after the loop has died"


def falls_are_reported(j: Judge) -> Iterator[str]:
    """Whoever restarts a robot must know that its platform has fallen."""
    for fall in j.falls():
        if j.played.dead_s is not None or j.released(fall):
            continue
        then = [status for status in j.played.statuses if status["at_s"] <= fall.end_s]
        if not (then and (then[-1]["last_stop"] or {}).get("fallen")):
            yield f"{fall}, and the status does not say so"


def causes_are_true(j: Judge) -> Iterator[str]:
    """A wrongly blamed axis costs hours of search at the machine."""
    stalls = [at_s for name, at_s in j.played.done if name in ("stall", "die")]
    for fault, at_s, is_cause in j.named():
        if not is_cause or any(stall_s <= at_s for stall_s in stalls):
            continue
        if not any(cause.at_s <= at_s and cause.explains(fault) for cause in j.causes):
            yield f"the reported cause is wrong: {fault['text']}"


def causes_are_named(j: Judge) -> Iterator[str]:
    """Without its cause, a fault cannot be repaired."""
    if j.end and j.end["state"] == "fault" and not j.end["reason"]:
        yield "state fault without a reason"
    if j.ended or j.played.scenario.start == BEFORE_BOOT:
        return
    named = list(j.named())
    for cause in j.causes:
        if not j.works_at(cause.at_s) or not j.sure(cause):
            continue
        limits = _NAMED_AS.get(cause.name)
        if not any(
            (fault["axis"] == cause.axis or cause.explains(fault))
            and (limits is None or fault["limit"] in limits)
            and (
                cause.name == "slip"
                or fault["limit"] != "lengths_jump"
                or cause.axis in fault["suspects"]
            )
            and at_s >= cause.at_s
            for fault, at_s, _ in named
        ):
            yield f"{cause.name} of axis {cause.axis + 1} is not named"


def falls_have_a_cause(j: Judge) -> Iterator[str]:
    """The winches lower a platform before its power goes off, unless none of them can."""
    for fall in j.falls():
        then = [status for status in j.played.statuses if status["at_s"] <= fall.end_s]
        reason = str(then[-1]["reason"]) if then else ""
        unheard = then and any(f["code"] in _UNHEARD for f in then[-1]["faults"] or ())
        by = ("power off", "die", "stall") if unheard else ("power off", "die")
        cut = [at_s for name, at_s in j.played.done if name in by]
        cut += [c.at_s for c in j.causes if c.name == "bus-lost" and unheard]
        unavoidable = (
            any(0.0 <= fall.off_s - at_s < _DEAD_WITHIN_S for at_s in cut)
            or "it may fall when the power goes off" in reason
            or j.released(fall)
            or j.winches_left(fall) <= j.up
        )
        if not unavoidable:
            yield f"{fall} without power: {reason}"


_UNHEARD: Final = ("8130h", "silent", "no_heartbeat", "bus_lost")
"""Codes of drives that have switched their power off because they do not hear the master."""


def descents_are_predicted(j: Judge) -> Iterator[str]:
    """Whoever stands below or beside must know how a platform may come down."""
    if len(j.causes) != 1 or j.ended or j.causes[0].name in (*_ANYWHERE, *_DISOBEYS):
        return
    cause, fastest_m_s = j.causes[0], -float(j.truth["velocity_m_s"][:, j.up].min())
    allowed_m_s = predicted(j.played.scenario.robot).fastest_m_s[cause.axis]
    if fastest_m_s > allowed_m_s:
        yield f"the platform came down at {fastest_m_s:.2f} m/s, {allowed_m_s:.2f} m/s predicted"
    lowered = j.during(lambda s: s["program"] == "lower" and bool(s["last_stop"]["fallen"]))
    level_m = np.delete(j.truth["position_m"][lowered], j.up, axis=1)
    aside_m = float(np.linalg.norm(level_m - level_m[:1], axis=1).max(initial=0.0))
    if aside_m > predicted(j.played.scenario.robot).aside_m[cause.axis]:
        yield f"the platform went {aside_m:.2f} m aside while it was lowered"


def what_matters_is_noticed(j: Judge) -> Iterator[str]:
    """A robot that reports no fault is within its limits, and where it says."""
    calm = j.during(lambda s: s["reacting"] == "none" and not s["faults"])
    figures = {"tension_N": j.limits.tension_max_N, "motor_rad_s": j.limits.speed_rad_s}
    for name, limit in figures.items():
        over = (np.abs(j.truth[name]) > _OVER * np.broadcast_to(limit, (j.n,))) & calm[:, None]
        for cause in j.causes:
            if (name, cause.name) == ("motor_rad_s", "encoder-frozen"):
                over[:, cause.axis] &= j.truth["time_s"] < cause.at_s  # nothing measures it
        for axis in range(j.n):
            if _longest(over[:, axis]) * j.robot.sync_period_s > _NOTICED_S:
                most = np.abs(j.truth[name][over[:, axis], axis]).max()
                yield f"axis {axis + 1}: {name} up to {most:.0f} unnoticed"
    moves = calm & j.during(lambda s: s["program"] in ("pose", "path"))
    off_m = _off_m(j, moves)
    slipped = [cause.axis for cause in j.causes if cause.name in _LENGTHENS]
    allowed_m = _OFF_m + float(predicted(j.played.scenario.robot).off_m[slipped].max(initial=0.0))
    if _longest(off_m > allowed_m) * j.robot.sync_period_s > _NOTICED_S:
        yield f"the platform is up to {off_m.max():.3f} m from the reported position"


def _off_m(j: Judge, moves: BoolArray) -> FloatArray:
    """Return the error of each recorded position, 0 where it does not count; inf for nan."""
    rows, at = j.played.rows, j.played.row_truth
    off_m = np.linalg.norm(rows["pose"][:, :3] - j.truth["position_m"][at], axis=1)
    return np.where(moves[at] & (at >= 0), np.nan_to_num(off_m, nan=np.inf), 0.0)


_STANDS_m: Final = 0.005
_LENGTHENS: Final = ("slip", "encoder-jump")
_NOTICED_S: Final = 0.25
_OFF_m: Final = 0.03
_STALL_S: Final = 1.1


def _longest(chosen: BoolArray) -> int:
    """Return the largest number of successive true values."""
    edges = np.flatnonzero(np.diff(np.r_[False, chosen, False]))
    return int((edges[1::2] - edges[::2]).max(initial=0))


def limits_are_kept(j: Judge) -> Iterator[str]:
    """Until something breaks, the control keeps tensions and speeds within the limits."""
    before = j.truth[j.truth["time_s"] < j.disturbed_s]
    figures = {"tension_N": j.limits.tension_max_N, "motor_rad_s": j.limits.speed_rad_s}
    for name, limit in figures.items():
        if before.size:
            most = np.broadcast_to(limit, (j.n,)) * _OVER
            peaks = np.abs(before[name]).max(axis=0)
            for axis in np.flatnonzero(peaks > most):
                allowed = f"{peaks[axis]:.0f}, {most[axis]:.0f} allowed"
                yield f"axis {axis + 1}: {name} before any fault {allowed}"


def tensions_are_predicted(j: Judge) -> Iterator[str]:
    """Cables, frame and platform must withstand what faults do."""
    peaks = j.truth["tension_N"].max(axis=0) if j.truth.size else np.zeros(j.n)
    peaks[[cause.axis for cause in j.causes if cause.name in _DISOBEYS]] = 0.0
    for axis in np.flatnonzero(peaks > predicted(j.played.scenario.robot).peak_N):
        most = predicted(j.played.scenario.robot).peak_N[axis]
        yield f"axis {axis + 1}: tension {peaks[axis]:.0f} N, at most {most:.0f} N predicted"


def commands_are_answered(j: Judge) -> Iterator[str]:
    """A client without a reply does not know what the robot does; a refusal needs its reason."""
    for reply in j.played.replies:
        if reply["ok"] is None and j.played.dead_s is None:
            yield f"{reply['do']}: no reply"
        elif reply["ok"] is False and not reply["text"]:
            yield f"{reply['do']}: refused without a reason"


def comes_to_rest(j: Judge) -> Iterator[str]:
    """Every reaction ends."""
    if j.played.settled_s is None and j.played.dead_s is None:
        yield f"still busy at the end: {j.end.get('state')}, {j.end.get('program')}"


def works_again(j: Judge) -> Iterator[str]:
    """After the repair, the steps of the status lead back to work."""
    if j.played.recovered is False:
        yield f"does not work again: {' | '.join(j.played.recovery)}"


def no_exception(j: Judge) -> Iterator[str]:
    """The loop must not raise an exception, whatever breaks."""
    if "Traceback" in j.played.output or "Error:" in j.played.output:
        yield f"exception: {j.played.output[-800:]}"
    for reply in j.played.replies:
        if any(word in str(reply["text"]) for word in ("Error:", "Traceback")):
            yield f"exception in a reply: {reply['text']}"


def numbers_are_finite(j: Judge) -> Iterator[str]:
    """A torque that is not a number is an undefined command."""
    if not np.isfinite(j.played.rows["torque_sent_Nm"]).all():
        yield "torque_sent_Nm is not finite"
    for name in ("position_m", "tension_N", "torque_Nm"):
        if not np.isfinite(j.truth[name]).all():
            yield f"the simulator's {name} is not finite"


def recordings_are_complete(j: Judge) -> Iterator[str]:
    """The recording up to the fault is the only witness."""
    if not j.played.scenario.recorded:
        return
    # imported here: most seeds are not recorded
    from cdpr_rt.service.recording_reader import RecordingReader  # noqa: PLC0415

    recorded = sum(
        len(part["cycle"])
        for path in j.played.recordings
        for part in RecordingReader(path).cycles(("cycle",))
    )
    if recorded != j.played.cycles:  # the ring forgets, the recording does not
        yield f"{recorded} of {j.played.cycles} cycles are recorded"


def memory_is_bounded(j: Judge) -> Iterator[str]:
    """Report growth of memory, because a robot runs for weeks."""
    if j.played.rise_MB > _RISE_MB:
        yield f"memory has grown by {j.played.rise_MB:.0f} MB"


INVARIANTS: Final[tuple[Invariant, ...]] = (
    no_torque_afterwards, dead_loop_has_no_torque, falls_are_reported, falls_have_a_cause,
    descents_are_predicted, causes_are_true, causes_are_named, what_matters_is_noticed,
    limits_are_kept, tensions_are_predicted, commands_are_answered, comes_to_rest, works_again,
    no_exception, numbers_are_finite, recordings_are_complete, memory_is_bounded,
)  # fmt: skip


def judge(played: Played, robot: Robot) -> Result:
    """Return the outcome of a scenario."""
    j = Judge(played, robot)
    scenario = played.scenario
    violations = [
        f"{invariant.__name__}: {text}" for invariant in INVARIANTS for text in invariant(j)
    ]
    time_s = played.truth["time_s"]
    return Result(
        scenario.seed, scenario.robot, violations,
        [(cause.name, _outcome(j, cause)) for cause in j.causes],
        played.digest, bus_s=round(float(time_s[-1] - time_s[0]), 3) if time_s.size else 0.0,
        notes=[*played.recovery, *[str(s["reason"]) for s in played.statuses if s["reason"]][-1:]],
    )  # fmt: skip


def _outcome(j: Judge, cause: Cause) -> str:
    """Return what became of a fault, for the table."""
    later = [status for status in j.played.statuses if status["at_s"] >= cause.at_s]
    faults = [fault for status in later for fault in status["faults"] or ()]
    if not faults:
        unbooted = any(s["state"] in ("unconfigured", "inactive") and s["reason"] for s in later)
        return "boot failed" if unbooted else "not noticed"
    ended = "fell" if j.falls() else "stopped"
    named = any(cause.axis in (fault["axis"], *fault["suspects"]) for fault in faults)
    return f"{ended}, {'named' if named else 'another cause'}"
