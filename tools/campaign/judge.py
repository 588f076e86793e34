"""Judge what a robot did in a scenario, by the truth and by what the robot reported."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import Any, Final

import numpy as np

from cdpr_profiles import Robot
from cdpr_rt.model.robot_arrays import limits_of
from cdpr_tools.campaign.play import Played
from cdpr_tools.campaign.scenario import TIGHT

_TORQUE_Nm: Final = 1e-3
_DEAD_WITHIN_S: Final = 1.5
"""Longest time of the drives until they are without power, after their master has died."""
_FELL_m: Final = 0.05
_TENSION_OVER: Final = 1.25
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
    bus_s: float = 0.0
    notes: list[str] = field(default_factory=list)


class Judge:
    """What a judge derives from a played scenario."""

    def __init__(self, played: Played, robot: Robot) -> None:
        self.played, self.robot = played, robot
        self.limits = limits_of(robot)
        self.truth, self.n = played.truth, len(robot.axes)
        self.end = played.statuses[-1] if played.statuses else {}
        self.causes = [Cause(fault, played.began_s) for fault in played.scenario.faults]

    @property
    def disturbed_s(self) -> float:
        """Bus time of the first fault or stall."""
        begun_s = self.played.began_s
        times = [begun_s + fault["at_s"] for fault in self.played.scenario.faults]
        times += [at_s for name, at_s in self.played.done if name in ("stall", "die")]
        return float(min(times))

    def named(self) -> Iterator[tuple[dict[str, Any], float, bool]]:
        """Yield each fault that the robot named: its record, when, and whether as the cause."""
        seen = set()
        for status in self.played.statuses:
            for i, fault in enumerate(status["faults"] or ()):
                key = fault["limit"], fault["axis"], fault["code"]
                if key not in seen:
                    seen.add(key)
                    yield fault, status["at_s"], i == 0

    def off_since(self) -> float | None:
        """Return the bus time since when no motor has had a torque; None if some has."""
        powered = np.flatnonzero((np.abs(self.truth["torque_Nm"]) > _TORQUE_Nm).any(axis=1))
        if not powered.size:
            return float(self.truth["time_s"][0])
        if powered[-1] == self.truth.size - 1:
            return None
        return float(self.truth["time_s"][powered[-1]])

    def fall_m(self) -> float:
        """Return how far the platform has moved since the power went off for the last time."""
        off_s = self.off_since()
        if off_s is None:
            return 0.0
        position = self.truth["position_m"][self.truth["time_s"] >= off_s]
        return float(np.linalg.norm(position - position[0], axis=1).max())


class Cause:
    """An injected fault."""

    def __init__(self, fault: dict[str, Any], began_s: float) -> None:
        self.name, self.axis = str(fault["fault"]), int(fault["axis"] or 0) - 1
        self.at_s = began_s + fault["at_s"]

    def explains(self, named: dict[str, Any]) -> bool:
        """Return whether a fault that the robot named may follow from this one."""
        axis, limit = named["axis"], named["limit"]
        if axis in (self.axis, -1) or self.axis in named["suspects"] or self.name in _ANYWHERE:
            return True
        return limit in _PULLED and self.name in _PULLING


_PULLED: Final = ("tension_high", "lengths", "lengths_jump")
"""Limits that cables exceed because another cable pulls too much, or no longer."""
_PULLING: Final = (
    "cut-cable", "slip", "encoder-jump", "encoder-frozen", "encoder-noise", "pre-operational",
    "caught-cable", "torque-stuck", "torque-bias", "torque-limit", "commands-ignored",
)  # fmt: skip
_ANYWHERE: Final = ("push-x", "push-y", "obstacle", "payload", "bus-lost")
"""Faults that concern all axes."""


# The invariants. Each yields what was violated.

Invariant = Callable[[Judge], Iterator[str]]


def no_torque_afterwards(j: Judge) -> Iterator[str]:
    """A robot that reports no power has none: people go near it."""
    if j.end and j.end["state"] in ("ready", "fault", "inactive", "unconfigured"):
        settled = j.played.settled_s
        if settled is not None and j.played.dead_s is None and j.played.recovered is None:
            late = j.truth[j.truth["time_s"] > settled + 0.05]
            if (np.abs(late["torque_Nm"]) > _TORQUE_Nm).any():
                yield f"a motor has torque in state {j.end['state']}"


def dead_loop_has_no_torque(j: Judge) -> Iterator[str]:
    """Drives without a master must stop on their own: nobody else can stop them."""
    if j.played.dead_s is not None:
        late = j.truth[j.truth["time_s"] > j.played.dead_s + _DEAD_WITHIN_S]
        for axis in np.flatnonzero((np.abs(late["torque_Nm"]) > _TORQUE_Nm).any(axis=0)):
            yield f"axis {axis + 1} has torque {_DEAD_WITHIN_S:g} s after the loop has died"


def falls_are_reported(j: Judge) -> Iterator[str]:
    """Whoever restarts a robot must know that its platform has fallen."""
    if j.played.dead_s is not None or j.played.recovered is not None or not j.end:
        return
    fell_m = j.fall_m()
    if fell_m > _FELL_m and not (j.end["last_stop"] or {}).get("fallen"):
        yield f"the platform fell {1e3 * fell_m:.0f} mm, and the status does not say so"


def causes_are_true(j: Judge) -> Iterator[str]:
    """A wrongly blamed axis costs hours of search at the machine."""
    stalls = [at_s for name, at_s in j.played.done if name in ("stall", "die")]
    for fault, at_s, is_cause in j.named():
        if not is_cause or any(stall_s <= at_s for stall_s in stalls):
            continue
        if not any(cause.at_s <= at_s and cause.explains(fault) for cause in j.causes):
            yield f"the cause is not true: {fault['text']}"


def causes_are_named(j: Judge) -> Iterator[str]:
    """Without its cause, a fault cannot be repaired."""
    if not j.end or j.end["state"] != "fault":
        return
    if not j.end["reason"]:
        yield "state fault without a reason"


def limits_are_kept(j: Judge) -> Iterator[str]:
    """Until something breaks, the control keeps tensions and speeds within the limits."""
    if j.played.scenario.start != TIGHT:
        return
    until_s = j.disturbed_s
    before = j.truth[j.truth["time_s"] < until_s]
    if not before.size:
        return
    most = np.broadcast_to(j.limits.tension_max_N, (j.n,)) * _TENSION_OVER
    for axis in np.flatnonzero((before["tension_N"] > most).any(axis=0)):
        peak = before["tension_N"][:, axis].max()
        yield f"axis {axis + 1}: tension {peak:.0f} N before any fault, {most[axis]:.0f} N allowed"


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
    """An exception in the loop is a mistake of the program, whatever breaks."""
    if "Traceback" in j.played.output or "Error:" in j.played.output:
        yield f"exception: {j.played.output[-800:]}"
    for reply in j.played.replies:
        if any(word in str(reply["text"]) for word in ("Error:", "Traceback")):
            yield f"exception in a reply: {reply['text']}"


def numbers_are_finite(j: Judge) -> Iterator[str]:
    """A torque that is not a number is an undefined command."""
    for name in ("torque_sent_Nm",):
        if j.played.rows.size and not np.isfinite(j.played.rows[name]).all():
            yield f"{name} is not finite"
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
    if recorded != j.played.rows.size:
        yield f"{recorded} of {j.played.rows.size} cycles are recorded"


def memory_is_bounded(j: Judge) -> Iterator[str]:
    """A robot runs for weeks."""
    if j.played.rise_MB > _RISE_MB:
        yield f"memory has grown by {j.played.rise_MB:.0f} MB"


INVARIANTS: Final[tuple[Invariant, ...]] = (
    no_torque_afterwards, dead_loop_has_no_torque, falls_are_reported, causes_are_true,
    causes_are_named, limits_are_kept, commands_are_answered, comes_to_rest, works_again,
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
    if not later:
        return "not noticed"
    named = any(
        fault["axis"] == cause.axis or cause.axis in fault["suspects"]
        for status in later
        for fault in status["faults"] or ()
    )
    reactions = {str(status["reacting"]) for status in later} - {"none"}
    if not reactions and not any(status["state"] == "fault" for status in later):
        return "named" if named else "not noticed"
    ended = "fell" if j.fall_m() > _FELL_m else "stopped"
    return f"{ended}, {'named' if named else 'another cause'}"
