"""Readable status of a daemon, and the known facts if its control loop has died."""

from __future__ import annotations

import math
import time
from collections.abc import Iterable, Mapping
from typing import Any, Final

from rich.text import Text

from cdpr_rt.robot import is_done
from cdpr_tools.output import Output, TableText, time_text
from cdpr_tools.robots.calibration_text import calibration_text

DEAD: Final = "dead"
"""The state that a daemon reports if its loop has died."""
ENDED: Final = "the loop has ended"
"""Reason of a dead loop as long as no failure is reported."""


def has_died(status: dict[str, Any]) -> bool:
    """Return whether the control loop has died, rather than ended on request."""
    return bool(status["state"] == DEAD and status["reason"] != ENDED)


def power_text(status: dict[str, Any]) -> str:
    """Return the known state of the drives' power since the loop died."""
    if status.get("read_only"):
        return "it only listened and commanded no drive"
    if not status.get("driving") and not status.get("busy"):  # busy switching power on or off
        return "its drives had been commanded to switch off"
    return "drives that had power stop without its heartbeat: check that they have stopped"


def death_text(status: dict[str, Any]) -> str:
    """Return as text that the control loop has died, the power's state, and the next command."""
    return (
        f"{status['reason']}; {power_text(status)}; next: `cdpr stop` ends the rest of "
        "the daemon, then `cdpr run` starts it again"
    )


def after_stop_text(status: dict[str, Any]) -> str:
    """Return as text that a daemon has ended, and the drives' power in its last `status`."""
    if has_died(status):
        return f"ended; its loop had died: {power_text(status)}; next: `cdpr run` starts it again"
    if status["read_only"]:
        return f"ended: {power_text(status)}"
    if not (unheard := unheard_axes(status)):
        return "stopped, power off"
    return f"stopped; these drives do not answer and may have power: {', '.join(unheard)}"


def unheard_axes(status: dict[str, Any]) -> list[str]:
    """Return the names of axes whose drives were not heard, so that their power is unknown.

    Empty for a daemon that only listened, or whose loop had died.
    """
    if has_died(status) or status["read_only"]:
        return []
    return [str(axis.get("name")) for axis in status["axes"] if axis.get("alive") is False]


CONTINUE = "`cdpr path resume` continues"
_OPTIONS = {"live_view": "--live", "stream": "--stream"}
_STAGES = {
    ("tighten", "slack"): "winding in the slack of the cables",
    ("tighten", "pull"): "pulling the cables tight",
    ("tighten", "beyond"): "raising the tensions by half, to measure friction and cogging",
    ("tighten", "back"): "returning to the first tensions",
    ("tighten", "below"): "halving the tensions, to measure friction and cogging",
    ("tighten", "lengths"): "measuring the cable lengths",
    ("tighten", "index"): "moving the platform until each motor's index has passed",
    ("tighten", "held"): "holding the platform",
    ("lower", "home"): "moving the platform home, above its stand",
    ("lower", "down"): "lowering the platform",
    ("lower", "fade"): "slackening the cables",
    ("path", "set out"): "braking before the path",
    ("path", "to the path"): "moving to the path",
    ("path", "path"): "following the path",
}
"""Text for each stage of a program."""
_SILENT_s: Final = 1.0
"""A loop that has run no cycle for this time hangs: its data about the robot are old."""
_COLOURS = {"active": "green", "fault": "red", "dead": "red", "ready": "cyan"}


def status_text(status: dict[str, Any]) -> list[Text | str]:
    """Return the lines and the table of `cdpr status`."""
    described = any(axis.get("name") for axis in status["axes"])  # not before the loop is loaded
    return [*_lines(status), *[_axes(status)] * described]


def _lines(status: dict[str, Any]) -> list[Text]:
    state = status["state"]
    factor, slow = status.get("real_time_factor"), slow_text(status)
    lockstep = "lockstep" if factor is None or slow else f"lockstep at {factor:.2f} of real time"
    how = ["read-only"] * bool(status["read_only"]) + [lockstep] * bool(status["lockstep"])
    first = Text.assemble(
        f"{status['robot']}: ",
        (state, f"bold {_COLOURS.get(state, 'yellow')}"),
        f", program {status['program']}" if status["program"] and state != DEAD else "",
        "".join(f", {word}" for word in how),
    )
    lines = [first]
    silent_s = status["loop"]["silent_s"]
    if state != DEAD and silent_s > _SILENT_s:
        lines.append(
            Text(
                f"the loop has run no cycle for {silent_s:.1f} s: the values below are that old",
                style="red",
            )
        )
        if not status["lockstep"]:  # in lockstep, time stands still with the loop
            lines.append(Text(power_text(status), style="red"))
    if slow:
        lines.append(Text(f"{slow}: this machine is busy, or too slow", style="yellow"))
    if status["reason"]:
        lines.append(Text(f"reason: {status['reason']}", style="yellow"))
    if state == DEAD:
        return [*lines, *_of_dead(status)]
    platform = "; ".join(filter(None, (platform_text(status), tightness_text(status))))
    motors = compensation_text(status["axes"]), learnt_text(status), _calibration(status)
    lines += [Text(text) for text in (platform, _left_path(status), *motors) if text]
    return [
        *lines,
        *_loop_lines(status),
        *(Text(f"note: {x}", style="dim") for x in status["notices"] if not _is_reason(x, status)),
        *(Text(step, style="bold") for step in next_steps(status)),
    ]


def _is_reason(notice: str, status: dict[str, Any]) -> bool:
    """Return whether a notice only repeats the reason of a fault."""
    return bool(status["reason"]) and notice.startswith(status["reason"])


def _calibration(status: dict[str, Any]) -> str:
    known = status["calibration"]
    return "" if known is None else calibration_text(known)


def _left_path(status: dict[str, Any]) -> str:
    path = (status.get("program_progress") or {}).get("path")
    if path and status["program"] == "hold" and path["time_s"] < path["duration_s"]:
        return f"{left_text(path)}; {CONTINUE}"
    return ""


def _loop_lines(status: dict[str, Any]) -> list[Text]:
    """Return who may move the robot, and the state of the loop and its parts."""
    lines = []
    control = status["control"]
    if control["held"]:
        lines.append(Text(f"the right to move: {control['client']}"))
    cycle = status["cycle"]
    if cycle:
        lines.append(
            Text(
                f"cycle {cycle['cycle']}, {cycle['time_s']:.1f} s: answers after "
                f"{_us(cycle['exchange_s'])}, computed in {_us(cycle['compute_s'])}; "
                f"{cycle['missed']} answers missed, {cycle['late_cycles']} cycles late"
            )
        )
    for name, bus in (status.get("buses") or {}).items():
        if counts := bus.get("counts"):
            words = ", ".join(f"{key.replace('_', ' ')} {n} times" for key, n in counts.items())
            lines.append(Text(f"bus {name}: {words}; {bus['state']}", style="yellow"))
    for part, option in _OPTIONS.items():
        if error := status["parts"].get(part, {}).get("error"):
            lines.append(Text(f"{option} failed: {error}", style="red"))
    recording = status["parts"].get("recording")
    if recording:
        lines.append(Text(_recording(recording)))
    return lines


def _of_dead(status: dict[str, Any]) -> list[Text]:
    """Return the known facts of a robot whose control loop has died, and what to do next."""
    place = place_text(status.get("program_progress") or {})
    last = f"; {place} at that time; its present position is not known" if place else ""
    return [
        Text(power_text(status)),
        Text("next: `cdpr stop` ends the rest of the daemon, `cdpr run` starts it again"),
        Text(f"the following is {status['loop']['silent_s']:.0f} s old{last}", style="dim"),
    ]


def platform_text(status: dict[str, Any]) -> str:
    """Return where the platform is and its obstacles; empty for robots without a platform."""
    progress = status.get("program_progress") or {}
    target = _place(progress, "target_")
    words = [text for text in (place_text(progress), target and f"target {target}") if text]
    if stage := stage_text(status.get("program", ""), progress):
        words.append(stage)
    found = (progress.get(key) for key in ("missing", "held_back", "trouble"))
    words += [text for text in found if text]
    return "; ".join(words)


def learnt_text(status: dict[str, Any]) -> str:
    """Return the estimates for motors that were not commissioned, or ""."""
    progress = status.get("program_progress") or {}
    parts = []
    for what in ("friction", "cogging"):
        learnt = progress.get(f"learnt_{what}_Nm") or [0.0]
        if max(learnt) > 0.0:
            parts.append(f"{what} {min(learnt):.3f} to {max(learnt):.3f} Nm")
    return f"estimated from the motors: {', '.join(parts)}" if parts else ""


def left_text(path: dict[str, Any]) -> str:
    """Return where an interrupted path can be resumed."""
    return f"path {path['name']} stopped at {percent_text(path)}, line {path['line']}"


def percent_text(path: dict[str, Any]) -> str:
    """Return the completed share of a path in percent."""
    return f"{100.0 * path['time_s'] / max(path['duration_s'], 1e-9):.0f} %"


def place_text(progress: dict[str, Any]) -> str:
    """Return where the platform is; empty if that is unknown."""
    place = _place(progress)
    return place and f"platform at {place}"


def target_text(progress: dict[str, Any]) -> str:
    """Return the target of the platform or the axes, or ""."""
    target = _place(progress, "target_")
    if not target and progress.get("target_rad"):
        target = f"{_listed(progress['target_rad'], math.degrees(1.0), 1)} deg"
    return target and f"moving to {target}"


def _place(progress: dict[str, Any], of: str = "") -> str:
    """Return a place and the rotation there in mm and deg, or ""."""
    place, turned = progress.get(f"{of or 'position_'}m"), progress.get(f"{of}rotation_rad")
    text = f"{_listed(place, 1e3, 1)} mm" if place else ""
    if text and turned:
        text += f", turned by {_listed(turned, math.degrees(1.0), 2)} deg"
    return text


def stage_text(program: str, progress: dict[str, Any]) -> str:
    """Return the present stage of a program that has stages; empty for others."""
    stage = str(progress.get("stage") or "")
    if progress.get("was_tight") is False and stage in (
        "home",
        "down",
    ):  # the platform may be standing
        return "paying out the cables; a platform that hangs on them comes down"
    if stage == "home" and progress.get("blind"):  # the way there is unknown
        stage = "down"
    return _STAGES.get((program, stage), stage)


_LOOSE_N = 1.0
"""Tension below which a cable is called loose."""


def next_steps(status: dict[str, Any]) -> list[str]:
    """Return what to do before a robot can move, as lines with commands; none if it can or moves.

    The broken parts that it names are those known to the controller: the cause of a fault, and
    cables that seemed broken and have not been tight since.
    """
    state, last = status["state"], status.get("last_stop")
    if status["read_only"] or status.get("busy") or status.get("reacting", "none") != "none":
        return []
    if status.get("released"):  # the loop takes the drives again when the procedure ends
        return []
    if state in ("unconfigured", "inactive") and status["reason"]:
        return ["next: remove the cause, then `cdpr check`"]
    progress = status.get("program_progress") or {}
    failed = status["program"] == "tighten" and bool(progress.get("trouble"))
    rests = status["program"] == "hold" or (
        status["program"] == "jog"
        and (progress.get("left_s") == 0.0 or progress.get("done") == 1.0)
    )
    loose = last and (
        (rests and progress.get("tight") is False)
        or (status["program"] == "lower" and progress.get("done") == 1.0)
        or (failed and progress.get("tight") is False)
    )
    if state not in ("fault", "ready") and not (state == "active" and loose):
        return []
    steps = []
    broken = bool(last and last["broken"])
    if broken or failed or state == "fault":
        what = "repair the cable" if broken else "remove the cause"
        injected = is_simulated(status)
        mend = f"; if it was injected: `cdpr sim fault {status['robot']} mend`" if injected else ""
        steps.append(f"{what}{mend}")
    ready = ["`cdpr ack`"] * (state == "fault") + ["`cdpr enable`"] * (state != "active")
    if last is not None and not last["fallen"]:
        ready.append(f"`cdpr tighten{' --from home' * broken}`")
    if ready:
        steps.append(", ".join(ready))
    if last is not None and last["fallen"]:
        if put_back := put_back_text(status):
            steps.append(put_back)
        elsewhere = ""
        if all(axis.get("cable_length_m") is not None for axis in status["axes"]):
            elsewhere = "; if it stands upright elsewhere: `cdpr tighten --from lengths`"
        steps.append(
            "look at the platform, which has come down; if it stands at home, upright: "
            f"`cdpr tighten --from home`{elsewhere}"
        )
    return [f"next: {steps[0]}", *(f"      {step}" for step in steps[1:])]


def put_back_text(status: dict[str, Any]) -> str:
    """Return how to carry a simulated platform home after a fall; "" if it has not fallen."""
    if not (is_simulated(status) and (status.get("last_stop") or {}).get("fallen")):
        return ""
    return (
        f"`cdpr sim fault {status['robot']} put-back` carries the platform back to its start pose"
    )


_SLOW: Final = 0.9
"""Real-time factor below which a simulation is called slow."""


def slow_text(status: Mapping[str, Any]) -> str:
    """Return as text that a simulated robot runs slower than real time; empty if it does not."""
    factor = status.get("real_time_factor")
    if factor is None or factor >= _SLOW:
        return ""
    return f"the simulation runs at {factor:.2f} of real time"


def is_simulated(status: dict[str, Any]) -> bool:
    """Return whether all buses of the robot are simulated."""
    urls = [str(bus.get("url", "")) for bus in (status.get("buses") or {}).values()]
    return bool(urls) and all(url.startswith("simbus:") for url in urls)


def tightness_text(status: dict[str, Any]) -> str:
    """Return whether the cables hold the platform; empty for robots without one."""
    tight = (status.get("program_progress") or {}).get("tight")
    if tight is None or status["state"] != "active":
        return ""
    if tight:
        apart_mm = 1e3 * ((status["cycle"] or {}).get("lengths_disagree_m") or 0.0)
        agree = f", whose lengths agree within {apart_mm:.1f} mm" if apart_mm else ""
        return f"held by its cables{agree}"
    most_N = max((axis.get("tension_N") or 0.0 for axis in status["axes"]), default=0.0)
    # as after an interrupted `tighten`: a hold keeps the tension of the cables
    cables = f"not tight, tensions up to {most_N:.0f} N" if most_N >= _LOOSE_N else "loose"
    return f"cables {cables}, power on"


def _listed(values: Iterable[float], factor: float, digits: int) -> str:
    return ", ".join(f"{factor * value:z.{digits}f}" for value in values)


def _recording(recording: dict[str, Any]) -> str:
    if not recording.get("recording"):
        return f"not recording: {recording.get('error') or 'ended'}"
    lost = f", {recording['lost_rows']} cycles lost" if recording.get("lost_rows") else ""
    return f"recording {recording['file']}, {recording['bytes'] / 1e6:.1f} MB{lost}"


def _axes(status: dict[str, Any]) -> TableText:
    titles = "angle deg", "set deg", "speed deg/s", "torque Nm", "tension N", "cable m"
    rows = [["axis", *titles, ""]]
    for axis in status["axes"]:
        tension = _figure(axis.get("tension_N"), 1)
        measured = "" if axis.get("tension_measured") or tension == "-" else "~"
        row = [
            str(axis.get("name")),
            _figure(axis.get("position_rad"), 2, math.degrees(1.0)),
            _figure(axis.get("setpoint_rad"), 2, math.degrees(1.0)),
            _figure(axis.get("velocity_rad_s"), 2, math.degrees(1.0)),
            _figure(axis.get("torque_actual_Nm"), 3),
            f"{measured}{tension}",
            _figure(axis.get("cable_length_m"), 4),
            _trouble(axis),
        ]
        rows.append(row)
    return TableText(rows, left=[""])


def _trouble(axis: dict[str, Any]) -> str:
    if axis.get("alive") is None:
        return ""
    return ", ".join(["silent"] * (not axis["alive"]) + ["not valid"] * (not axis["valid"]))


def compensation_text(axes: list[dict[str, Any]]) -> str:
    """Return which motors' cogging is compensated; empty if none is known."""
    parts = []
    for known, words in ((True, "compensated"), (False, "not compensated until its index passes")):
        names = [
            str(axis["name"])
            for axis in axes
            if axis.get("commissioned") and bool(axis.get("index_known")) is known
        ]
        parts += [f"{words}: {', '.join(names)}"] * bool(names)
    left = [str(axis["name"]) for axis in axes if not axis.get("commissioned")]
    if parts and left:
        parts.append(f"not commissioned: {', '.join(left)}")
    return "; ".join(parts)


def _figure(value: float | None, digits: int, factor: float = 1.0) -> str:
    return "-" if value is None else f"{factor * value:.{digits}f}"


def _us(seconds: float | None) -> str:
    return "-" if seconds is None else f"{1e6 * seconds:.0f} us"


_TELL_S: Final = 2.0
"""Interval at which a motion reports its progress."""


class ProgressNotes:
    """Reports stages, delays and progress of a motion, each once.

    Facts that were in an earlier `status` are not reported.
    """

    def __init__(self, out: Output | None, status: dict[str, Any] | None = None) -> None:
        self._out = out
        self._stage = self._held_back = self._slow = ""
        if status is not None:
            progress = status.get("program_progress") or {}
            self._stage = _motion_stage(str(status["program"]), progress)
            self._held_back = progress.get("held_back") or ""
        self._slow_s = self._next_s = time.monotonic() + _TELL_S

    def __call__(self, status: Mapping[str, Any]) -> None:
        """Process the progress of the running program."""
        if self._out is None:
            return
        program, progress = str(status["program"]), status.get("program_progress") or {}
        if not self._slow and time.monotonic() >= self._slow_s:
            self._slow = slow_text(status)
            if self._slow:
                self._out.note(self._slow)
        stage = _motion_stage(program, progress)
        if stage and stage != self._stage:
            self._out.note(f"{stage} ...")
            self._next_s = time.monotonic() + _TELL_S
        held_back = progress.get("held_back") or ""
        if held_back and not self._held_back:
            self._out.note(held_back)
        self._stage, self._held_back = stage, held_back
        if not is_done(progress) and time.monotonic() >= self._next_s:
            self._next_s = time.monotonic() + _TELL_S
            if text := _so_far(program, progress):
                self._out.note(text)


def _motion_stage(program: str, progress: dict[str, Any]) -> str:
    if program == "path":
        return stage_text(program, progress.get("path") or {})
    return stage_text(program, progress) or target_text(progress)


def _so_far(program: str, progress: dict[str, Any]) -> str:
    """Return the progress of a motion: the place on a path, or the share done."""
    path = progress.get("path") or {}
    if program == "path" and path.get("stage") == "path":
        left_s = (path["duration_s"] - path["time_s"]) / max(path["feed"], 0.01)
        return (
            f"{path['name']}: {percent_text(path)}, line {path['line']}, "
            f"{time_text(left_s)} left at {100.0 * path['feed']:.0f} % feed"
        )
    if place := place_text(progress):
        return place
    if not (done := progress.get("done")):
        return ""
    leg = f"leg {progress['leg']} of {progress['legs']}, " if "legs" in progress else ""
    return f"{leg}{100.0 * done:.0f} %"
