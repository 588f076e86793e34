"""`cdpr jog|move|controller|tighten|lower|resume`: motion through a daemon."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import Annotated, Any, Final

import typer

from cdpr_rt.robot import Robot
from cdpr_tools.client.client import Daemon, axis_values, key_values
from cdpr_tools.client.motion import Outcome, carry_out, finish, require_platform, run_to_end
from cdpr_tools.client.refusals import in_typed_words
from cdpr_tools.commands.options import argument, option
from cdpr_tools.commands.with_daemon import with_daemon
from cdpr_tools.errors import BadInputError, WorkFailedError
from cdpr_tools.number_options import is_number, numbers, numbers_command
from cdpr_tools.output import Output

_JOG_S: Final = 1.0
_STANDING = frozenset({"hold", "idle"})


_COORDINATES: Final = {2: ("x", "y"), 3: ("x", "y", "z")}
_ANGLES: Final = ("angle", "rx", "ry", "rz")


class ReferenceFrame(StrEnum):
    """The frame whose axes a relative motion uses."""

    ROOM = "room"
    PLATFORM = "platform"


@dataclass(frozen=True)
class PlatformMove:
    """A motion of a platform as typed: mm, deg, mm/s."""

    to: str | None
    rotate: str | None
    relative: bool
    frame: ReferenceFrame
    speed: float | None

    @property
    def typed(self) -> str:
        """Return the options that give the target."""
        words = [f"--to {self.to}"] if self.to is not None else []
        words += [f"--rotate {self.rotate}"] if self.rotate is not None else []
        return " ".join(words)

    def arguments(self, daemon: Daemon) -> dict[str, Any]:
        """Return the arguments of the program `pose`; raises BadInputError."""
        description = daemon.get("/description")
        require_platform(description, self.typed, "; move its axes with AXIS=ANGLE...")
        platform = description["platform"]
        names = _COORDINATES[len(platform["home_m"])]
        turns = [name for name in platform.get("controlled", ()) if name in _ANGLES]
        to = None if self.to is None else self._position(self.to, names, platform)
        rotate = None
        if self.rotate is not None:
            if not turns:
                raise BadInputError(
                    f"--rotate {self.rotate}: this platform has no controlled angle; allowed: --to "
                    f"{' '.join(names).upper()}"
                )
            rotate = numbers("--rotate", self.rotate, turns, "deg", math.radians(1.0))
        if not self.relative and self.frame is not ReferenceFrame.ROOM:
            raise BadInputError(f"--frame {self.frame}: allowed only with --relative")
        if to is not None and not self.relative:
            self._require_millimetres(to, platform)
        keys = ("distance_m", "turn_rad") if self.relative else ("position_m", "rotation_rad")
        given: dict[str, Any] = dict(zip(keys, (to, rotate), strict=True))
        given["frame"] = self.frame.value if self.relative else None
        given["speed_m_s"] = None if self.speed is None else 1e-3 * self.speed
        return {key: value for key, value in given.items() if value is not None}

    def _position(self, to: str, names: Sequence[str], platform: dict[str, Any]) -> Sequence[float]:
        """Return a position that is typed in mm or by the name of a pose; raises BadInputError."""
        poses = dict(platform.get("poses_m", {}))
        if _is_inside(platform["home_m"], platform):
            poses["home"] = platform["home_m"]
        if to in poses:
            if self.relative:
                raise BadInputError(f"--to {to}: is a pose, not a distance; omit --relative")
            return list(poses[to])
        if to == "home":
            raise BadInputError(
                "--to home: home is on the stand, outside the workspace; `cdpr lower` puts the "
                "platform there"
            )
        return numbers("--to", to, names, "mm", 1e-3, words=poses)

    def _require_millimetres(self, to: Sequence[float], platform: dict[str, Any]) -> None:
        """Raise BadInputError if the typed position is in the workspace only if read as metres."""
        if _is_inside([1e3 * x for x in to], platform) and not _is_inside(to, platform):
            in_mm = " ".join(f"{1e6 * x:g}" for x in to)
            raise BadInputError(f"--to {self.to}: are these metres? In mm: --to {in_mm}")


def _is_inside(position_m: Sequence[float], platform: dict[str, Any]) -> bool:
    """Whether a position is in the box of targets."""
    low, high = platform["workspace_min_m"], platform["workspace_max_m"]
    return all(a <= x <= b for a, x, b in zip(low, position_m, high, strict=True))


app = typer.Typer()


@app.command(cls=numbers_command())
@with_daemon
def jog(
    daemon: Daemon,
    out: Output,
    axes: Annotated[
        list[str],
        argument(
            "Speeds in deg/s at the motor; or one step of a platform along x, y, z in mm, "
            "about angle, rx, ry, rz in deg, such as x=10.",
            metavar="AXIS=SPEED... | DIRECTION=STEP...",
        ),
    ],
    seconds: Annotated[
        float | None, option("Duration of a speed; 1 if left out.", min=0.1, max=3600.0)
    ] = None,
    cable: Annotated[
        bool, option("Speeds are mm/s of cable, positive pays out.", "--cable")
    ] = False,
) -> None:
    """Turn axes at a constant speed for a while, or move a platform by one step."""
    if (step := _step(daemon, axes)) is not None:
        if cable or seconds is not None:
            raise BadInputError(
                f"{' '.join(axes)}: is a step of the platform; omit --cable and --seconds"
            )
        with in_typed_words("jog", " ".join(axes)):
            run_to_end(daemon, out, "pose", step.arguments(daemon), arrived=True)
        return
    n, speeds = _given(daemon, axes, "mm/s" if cable else "deg/s")
    factor = 1e-3 if cable else math.radians(1.0)
    values = [factor * speeds.get(axis, 0.0) for axis in range(n)]

    def motion(robot: Robot) -> None:
        (robot.jog_cable if cable else robot.jog)(values, seconds or _JOG_S)

    with in_typed_words("jog", axes=_names(daemon)):
        outcome = carry_out(daemon, out, motion)
    finish(daemon, out, Outcome(outcome.stopped))


@app.command(cls=numbers_command("--to", "--rotate"))
@with_daemon
def move(
    daemon: Daemon,
    out: Output,
    axes: Annotated[
        list[str] | None, argument("Angles in deg of the motor.", metavar="[AXIS=ANGLE]...")
    ] = None,
    to: Annotated[
        str | None,
        option(
            "Move the platform to this position, in mm, or to a pose that the robot's file names.",
            metavar="X Y [Z] | NAME",
        ),
    ] = None,
    rotate: Annotated[
        str | None,
        option(
            "Turn the platform to this rotation vector from its orientation at home, in "
            "deg; in a plane one angle.",
            metavar="RX RY RZ | ANGLE",
        ),
    ] = None,
    relative: Annotated[
        bool, option("Move relative to the present position.", "--relative")
    ] = False,
    frame: Annotated[
        ReferenceFrame,
        option("With --relative: the axes along and about which the platform moves."),
    ] = ReferenceFrame.ROOM,
    cable: Annotated[
        bool,
        option(
            "Move relative to the present position, in mm of cable; positive pays out.", "--cable"
        ),
    ] = False,
    speed: Annotated[
        float | None,
        option(
            "Top speed: deg/s at the motor, or mm/s of a platform; its rotation is slowed down in "
            "proportion.",
            min=0.01,
        ),
    ] = None,
) -> None:
    """Move axes or the platform to a position and wait until they are there."""
    if to is not None or rotate is not None:
        if axes or cable:
            given = ", ".join([*(axes or []), *["--cable"] * cable])
            raise BadInputError(f"--to, --rotate: cannot be combined with axes or --cable: {given}")
        move = PlatformMove(to, rotate, relative, frame, speed)
        with in_typed_words("move", move.typed):
            run_to_end(daemon, out, "pose", move.arguments(daemon), arrived=True)
        return
    if frame is not ReferenceFrame.ROOM:
        raise BadInputError(f"--frame {frame}: allowed only with --to or --rotate")
    goals = _goals(daemon, axes or [], cable)

    def motion(robot: Robot) -> None:
        turn = robot.pay_out if cable else robot.turn_by if relative else robot.turn_to
        turn(goals, speed_rad_s=None if speed is None else math.radians(speed))
        robot.hold()

    with in_typed_words("move", axes=_names(daemon)):
        outcome = carry_out(daemon, out, motion)
    finish(daemon, out, outcome, arrived=True)


def _step(daemon: Daemon, texts: Sequence[str]) -> PlatformMove | None:
    """Return one step of the platform; None if axes are given. Raises BadInputError."""
    platform = daemon.get("/description").get("platform")
    if platform is None:
        return None
    places = _COORDINATES[len(platform["home_m"])]
    turns = [name for name in platform.get("controlled", ()) if name in _ANGLES]
    allowed = ", ".join([*(f"{x}=MM" for x in places), *(f"{x}=DEG" for x in turns)])
    given = dict(text.partition("=")[::2] for text in texts)
    axes = _names(daemon)
    if given.keys().isdisjoint({*places, *turns} - set(axes)):
        if given.keys().isdisjoint(axes):
            raise BadInputError(
                f"{' '.join(texts)}: allowed: {allowed} for a step of the platform, or AXIS=DEG_S "
                f"for the axes {', '.join(map(repr, axes))}"
            )
        return None
    for text in texts:
        name, _, value = text.partition("=")
        if name not in (*places, *turns) or not is_number(value) or given[name] != value:
            raise BadInputError(f"{text}: allowed: {allowed}, each once")
    to, rotate = (" ".join(given.get(name, "0") for name in some) for some in (places, turns))
    return PlatformMove(to, rotate or None, True, ReferenceFrame.ROOM, None)


def _names(daemon: Daemon) -> list[str]:
    return [str(axis["name"]) for axis in daemon.get("/status")["axes"]]


def _goals(daemon: Daemon, axes: list[str], cable: bool) -> list[float]:
    """Return the axes' targets, rad or m, nan for axes that do not move; raises BadInputError."""
    if not axes:
        raise BadInputError(
            "nothing to move; allowed: AXIS=ANGLE..., or --to and --rotate for a platform"
        )
    if "pid" not in daemon.get("/description").get("programs", ["pid"]):
        raise BadInputError(
            f"{' '.join(axes)}: this robot moves its platform: `cdpr move --to` with its position "
            "in mm, or with the name of a pose; `cdpr jog` turns a winch"
        )
    n, goals = _given(daemon, axes, "mm" if cable else "deg")
    factor = 1e-3 if cable else math.radians(1.0)
    return [factor * goals.get(axis, math.nan) for axis in range(n)]


@app.command()
@with_daemon
def controller(
    daemon: Daemon,
    out: Output,
    name: Annotated[str, argument("Program: hold, idle, sweep, pid, ...")],
    values: Annotated[
        list[str] | None, argument("Arguments of the program, in JSON.", metavar="[KEY=VALUE]...")
    ] = None,
    seconds: Annotated[
        float | None,
        option("End after this many seconds; by default when the program is done.", min=0.1),
    ] = None,
) -> None:
    """Run a program (a controller with its motion) until it is done, then hold.

    `hold` and `idle` keep running after the command has ended.
    """
    arguments = key_values(values or [])

    def motion(robot: Robot) -> None:
        robot.run(name, **arguments)
        if name not in _STANDING:
            robot.hold()

    finish(daemon, out, carry_out(daemon, out, motion, seconds=seconds or math.inf))


def _given(daemon: Daemon, texts: list[str], unit: str) -> tuple[int, dict[int, float]]:
    """Return the number of axes and the values given for some of them; raises BadInputError."""
    axes = daemon.get("/status")["axes"]
    values = axis_values(texts, axes, unit)
    for axis, value in values.items():
        if not math.isfinite(value):
            raise BadInputError(f"{axes[axis]['name']}={value:g}: allowed: a finite number")
    return len(axes), values


class LengthSource(StrEnum):
    """The source of the cables' lengths."""

    HOME = "home"
    LAST = "last"
    LENGTHS = "lengths"


@app.command()
@with_daemon
def tighten(
    daemon: Daemon,
    out: Output,
    source: Annotated[
        LengthSource | None,
        option(
            "Source of the cable lengths: home (the platform stands there), the lengths of the "
            "last stop, or those that the daemon knows. Default: what the daemon knows, else "
            "home.",
            "--from",
        ),
    ] = None,
) -> None:
    """Tighten the cables, measure where the platform is, and hold it."""
    arguments = {} if source is None else {"from": source.value}
    typed = "tighten" if source is None else f"tighten --from {source.value}"
    _require_platform(daemon, "tighten")
    with in_typed_words("tighten", typed, option="--from "):
        run_to_end(daemon, out, "tighten", arguments)


@app.command()
@with_daemon
def lower(
    daemon: Daemon,
    out: Output,
    blind: Annotated[
        bool, option("Pay out all cables, even if the platform's pose may be wrong.", "--blind")
    ] = False,
) -> None:
    """Lower the platform onto its stand and slacken the cables; the power stays on."""
    _require_platform(daemon, "lower")
    arguments = {"blind": True} if blind else {}
    status = daemon.get("/status")
    if status["program"] == "lower" and status["control"]["held"]:
        raise WorkFailedError(
            f"lower: {status['control']['client']} is already lowering the platform; `cdpr "
            "status --watch` shows it"
        )
    tight = (status.get("program_progress") or {}).get("tight")
    where = "lowered blind" if blind else "on its stand" if tight else "where it is"
    run_to_end(daemon, out, "lower", arguments, f"{where}, cables loose, power on")


@app.command()
@with_daemon
def resume(daemon: Daemon, out: Output) -> None:
    """Continue the move or path that was stopped by `cdpr hold` or Ctrl-C."""
    if (daemon.get("/status").get("program_progress") or {}).get("path"):
        from cdpr_tools.client.path_following import resume_path  # noqa: PLC0415  # slow to load

        resume_path(daemon, out)
        return
    _require_platform(daemon, "resume")
    with in_typed_words("resume", instead="cdpr move --to"):
        run_to_end(daemon, out, "pose", {"resume": True})


def _require_platform(daemon: Daemon, what: str) -> None:
    require_platform(daemon.get("/description"), what)
