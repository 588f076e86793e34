"""One robot as a script sees it: commands, state and log, in this process or through a daemon."""

from __future__ import annotations

import inspect
import json
import math
import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, contextmanager
from pathlib import Path
from types import TracebackType
from typing import Any, Final, Never, Protocol, Self, cast

import numpy as np
from numpy.typing import ArrayLike

from cdpr_rt.arrays import FloatArray, real_array
from cdpr_rt.core.cycle_row import FIELDS, Row, column_names
from cdpr_rt.refusal import CommandRefusal, RefusalCode


class Error(Exception):
    """Base class of all errors of a robot handle."""

    origin: Exception | None = None
    """Error of the daemon's client that this error replaces, if any."""


class InvalidRobot(Error):  # noqa: N818
    """The robot is unknown, or its file cannot be used; the message names file, key and value."""


class InvalidArgument(Error, ValueError):  # noqa: N818
    """An argument has a wrong shape, type or value. Nothing has moved."""


class NotRunning(Error):  # noqa: N818
    """No daemon of the robot runs, or the robot has ended."""


class AlreadyRunning(Error):  # noqa: N818
    """A daemon of this robot is already running; `connect` uses it."""


class Refused(Error):  # noqa: N818
    """The robot refused a command. Nothing has changed; the message gives the reason.

    `refusal` is the reason in a form for programs, and `code` is its code. Both are None if there
    is only the message.
    """

    def __init__(self, text: str, refusal: CommandRefusal | None = None) -> None:
        super().__init__(text)
        self.refusal = refusal
        self.code = None if refusal is None else refusal.code


class MotionEnded(Error):  # noqa: N818
    """A motion ended before its target, and the drives still have power.

    Another client commanded a hold or took the right to move, or the platform is blocked.
    """


class Faulted(Error):  # noqa: N818
    """A fault ended the motion and removed the power.

    `limit` is the key of the limit, `axis` the name of the axis. Each is None if the fault has no
    single limit or axis.
    """

    def __init__(self, text: str, limit: str | None = None, axis: str | None = None) -> None:
        super().__init__(text)
        self.limit = limit
        self.axis = axis


class Backend(Protocol):
    """Executes the commands of a `Robot`. All methods raise errors of this module."""

    description: Mapping[str, Any]
    """The robot as `GET /description` returns it."""
    look_s: float
    """Time between two checks of a motion."""

    def command(self, do: str, program: str = "", wanted: Mapping[str, Any] | None = None) -> None:
        """Send a command and wait for the reply; take the right to move if the command needs it."""

    def status(self) -> dict[str, Any]:
        """Return the present status as `GET /status` does."""

    def brief_status(self) -> Mapping[str, Any]:
        """Return the present status, at least state, program and its progress; called often."""

    def wait(self, seconds: float) -> None:
        """Let this time pass on the robot's clock, s."""

    def observe(self, seconds: float) -> Row:
        """Let this time pass on the robot's clock, s; return the cycles received during it."""

    def true_pose(self) -> FloatArray:
        """Return the true pose (7,) of a simulated platform."""

    def plan(self, file: Path) -> str:
        """Plan the path in a file; return the name of the plan."""

    def open_stream(self) -> AbstractContextManager[Callable[[Sequence[float], float], None]]:
        """Open a set-point stream; yield a function that sends a position (3,), m, and a scale."""

    def log(self, fields: Sequence[str]) -> Row:
        """Return these fields of all cycles recorded since the handle was opened."""

    def inject_fault(self, axis: int, fault: str, value: int | None) -> None:
        """Inject a fault into a simulated drive."""

    def end(self) -> None:
        """Lower the platform, remove the power, and end the robot's process."""

    def close(self) -> None:
        """Release the robot; idempotent."""


_RENEW_S: Final = 0.1
_JOG_TIMEOUT_S: Final = 0.6
_REACTION_S: Final = 120.0
_ANGLES: Final = ("angle", "rx", "ry", "rz")
_STANDING: Final = ("hold", "idle")
_STANDS: Final = ("the path waits here", "stepped back")
_NEXT: Final = {
    "ready": "call enable() first",
    "fault": "remove its cause, then call acknowledge() and enable()",
}
"""What makes a motion possible, by the state that refuses it."""
_LIKELY_mm: Final = 20.0
"""A refused position or distance above this, in m, has probably been given in mm."""
_SETTLE_S: Final = 2.0
_REST_RAD, _REST_RAD_S = math.radians(0.5), math.radians(2.0)


class Log(np.ndarray[Any, np.dtype[np.void]]):
    """Recorded cycles: a structured NumPy array, (cycles,).

    `log["pose"]` is the array of one field, here of shape (cycles, 7).
    """

    axes: tuple[str, ...] = ()
    """Names of the axes, n."""
    _field = ""
    """Name of the field if the rows belong to a single one."""

    def __array_finalize__(self, other: Any) -> None:
        self.axes = getattr(other, "axes", ())

    def __getitem__(self, key: Any) -> Any:
        found: Any = super().__getitem__(key)
        if isinstance(found, Log):
            if isinstance(key, str):
                found._field = key
            elif not isinstance(key, tuple) and found.ndim == self.ndim:  # a selection of rows
                found._field = self._field
        return found

    def to_pandas(self) -> Any:
        """Return a pandas.DataFrame with a column for each scalar, axis and pose coordinate.

        Columns have the names that `cdpr log export` gives them: `time_s`, `tension_N[left]`,
        `pose[qw]`. A single field such as `log["pose"]` gives only its own columns. Raises Error if
        pandas is not installed, and for arrays computed from a log, because they have no column
        names.
        """
        try:
            import pandas as pd  # noqa: PLC0415
        except ImportError:
            raise Error("pandas is not installed; install it with: pip install pandas") from None
        fields = {name: np.asarray(self[name]) for name in self.dtype.names or ()}
        if self._field:
            fields = {self._field: np.asarray(self)}
        if not fields:
            raise Error(
                "to_pandas: these numbers have no field's name; call it on a log or on one of its "
                'fields, as log["pose"].to_pandas()'
            )
        columns: dict[str, Any] = {}
        for field, values in fields.items():
            names = column_names(field, values.shape, self.axes)
            columns |= zip(names, values.T if values.ndim == 2 else [values], strict=True)
        return pd.DataFrame(columns)


class Robot:
    """A robot that a script commands; a context manager.

    `cdpr_rt.simulate`, `cdpr_rt.connect` and `cdpr_rt.run` return a robot. Lengths are in m, angles
    in rad, tensions in N, torques in Nm, times in s. n is the number of axes, k the number of
    coordinates of the platform (2 or 3), c the number of its controlled angles. Methods that move
    the robot return when the motion is done. They raise Refused before anything moves, Faulted if a
    fault removes the power, and MotionEnded if another client ends the motion. Ctrl-C stops a
    motion and holds the robot until the `with` block closes the handle. Without such a block, as in
    a notebook, Ctrl-C in a motion, `wait` or `observe` lowers the platform and removes the power.
    """

    def __init__(self, backend: Backend, *, in_block: bool = False) -> None:
        self._backend = backend
        description = backend.description
        self.name = str(description["robot"])
        """Name of the robot."""
        self.axes = tuple(str(axis["name"]) for axis in description["axes"])
        """Names of the axes, n."""
        self.on_status: Callable[[Mapping[str, Any]], object] | None = None
        """Function called with each status during a motion; if it raises, the robot holds."""
        platform = description.get("platform") or {}
        self._k = len(platform.get("home_m", ()))
        self._started = ""
        """Name of the program that this handle has started and that is not done yet."""
        self._in_block = in_block
        """Whether a block closes the handle after a Ctrl-C, so that a motion is only held."""
        self._c = len([name for name in platform.get("controlled", ()) if name in _ANGLES])

    def __enter__(self) -> Self:
        self._in_block = True
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self._in_block = False
        try:
            self.close()
        except Error as failed:
            if error is None:
                raise
            error.add_note(str(failed))

    def __repr__(self) -> str:
        return f"<Robot {self.name!r}>"

    def __reduce__(self) -> Never:
        raise TypeError("a Robot cannot be copied or pickled; open it in the process that uses it")

    def close(self) -> None:
        """Release the robot.

        A robot from `simulate` ends, one from `connect` holds its position, and one from `run`
        lowers its platform and ends.
        """
        self._backend.close()

    # -- state

    @property
    def status(self) -> dict[str, Any]:
        """The whole status, as `GET /status` of the control interface returns it.

        A simulation has no service: the keys `robot`, `loop`, `control`, `parts` and `calibration`
        are missing.
        """
        return self._backend.status()

    @property
    def description(self) -> Mapping[str, Any]:
        """The robot's axes, limits, platform and programs, as `GET /description` returns them."""
        return self._backend.description

    @property
    def state(self) -> str:
        """State of the control loop: unconfigured, inactive, ready, active or fault."""
        return str(self.status["state"])

    @property
    def program(self) -> str:
        """Name of the running program."""
        return str(self.status["program"])

    @property
    def reason(self) -> str:
        """Reason of the last fault or hold, or an empty text."""
        return str(self.status["reason"])

    @property
    def time_s(self) -> float:
        """Bus time of the newest cycle, s; nan before the first."""
        return _number((self.status["cycle"] or {}).get("time_s"))

    @property
    def pose(self) -> FloatArray:
        """Pose of the platform, (7,): x, y, z in m, quaternion w, x, y, z; nan if not known."""
        return _numbers((self.status["cycle"] or {}).get("pose"), 7)

    @property
    def true_pose(self) -> FloatArray:
        """True pose of a simulated platform, in the format of `pose`.

        The controller does not know it. Use it for comparison, or to simulate a measuring device.
        Raises Error if `simulate` has not opened the robot, and InvalidArgument for a robot without
        a platform.
        """
        return self._backend.true_pose()

    @property
    def position_m(self) -> FloatArray:
        """Position of the platform, (k,), m, as `move_to` takes it; nan if not known."""
        return _numbers(self._progress().get("position_m"), self._k)

    @property
    def rotation_rad(self) -> FloatArray:
        """Rotation vector from the orientation at home, (c,), rad; nan if not known."""
        return _numbers(self._progress().get("rotation_rad"), self._c)

    @property
    def tension_N(self) -> FloatArray:
        """Cable tensions, measured or estimated, (n,), N; nan where not known."""
        return self._axis_values("tension_N")

    @property
    def cable_length_m(self) -> FloatArray:
        """Cable lengths, (n,), m; nan where not known."""
        return self._axis_values("cable_length_m")

    @property
    def angle_rad(self) -> FloatArray:
        """Angles of the motors as the encoders count them, (n,), rad; nan before the first."""
        return self._axis_values("position_rad")

    @property
    def velocity_rad_s(self) -> FloatArray:
        """Estimated speeds of the motors, (n,), rad/s."""
        return self._axis_values("velocity_rad_s")

    @property
    def torque_Nm(self) -> FloatArray:
        """Torques that the drives report, (n,), Nm."""
        return self._axis_values("torque_actual_Nm")

    def log(self, *fields: str) -> Log:
        """Return the recorded cycles since the handle was opened: a structured array, (cycles,).

        `fields` are names of recorded fields, such as "time_s", "pose" (7,) and "tension_N" (n,);
        by default all fields. A simulation keeps the last 5 minutes. A daemon's rows come from its
        recording on this machine. Raises Error if the daemon records nothing.
        """
        if unknown := [name for name in fields if not isinstance(name, str) or name not in FIELDS]:
            raise InvalidArgument(f"fields: {unknown}; allowed: {', '.join(FIELDS)}")
        log = self._backend.log(tuple(dict.fromkeys(fields or FIELDS))).view(Log)
        log.axes = self.axes
        return log

    # -- power

    def enable(self, program: str = "hold") -> None:
        """Switch on the drives and run a program. No change if the drives already have power."""
        if self.state != "active":
            self._backend.command("enable", _plain("program", program))

    def disable(self) -> None:
        """Stop the motion under control, then remove the power. No change after a fault."""
        try:
            self._backend.command("disable")
        except Refused as error:
            if (
                error.code is not RefusalCode.NOT_IN_STATE
            ):  # in other states the power is already off
                raise
        self._started = ""

    def acknowledge(self) -> None:
        """Acknowledge a fault whose cause is gone; the drives stay without power.

        No change if there is no fault.
        """
        if self.state not in ("ready", "active"):
            self._backend.command("acknowledge")

    def shut_down(self) -> None:
        """Lower the platform, remove the power, end the robot and close the handle.

        This also ends a daemon that the script has not started. The call returns when the daemon
        has ended. Raises Error if the power may still be on.
        """
        try:
            self._backend.end()
        finally:
            self.close()

    # -- motion of a platform

    def tighten(self, source: str | None = None) -> None:
        """Take up the slack of the cables and find the pose; then the cables hold the platform.

        `source` is the source of the cable lengths: "home" (the platform stands at home), "last"
        (lengths of the last stop) or "lengths" (lengths that the loop already knows).
        """
        self.run("tighten", **({} if source is None else {"from": source}))

    def lower(self, *, blind: bool = False) -> None:
        """Lower the platform onto its stand; the power stays on.

        With `blind`, every winch pays out its cable without using a measured pose.
        """
        self.run("lower", **({"blind": True} if blind else {}))

    def move_to(
        self,
        position_m: ArrayLike | None = None,
        rotation_rad: ArrayLike | None = None,
        *,
        speed_m_s: float | None = None,
        wait: bool = True,
    ) -> None:
        """Move the platform to a position (k,) and a rotation (c,) on a straight line.

        `rotation_rad` is the rotation vector from the orientation at home. An omitted position or
        rotation stays unchanged. `speed_m_s` is the top speed, by default that of the robot's file.
        With `wait=False` the call returns immediately; `wait_until_done` waits for the end.
        """
        self._move(wait, speed_m_s, position_m=position_m, rotation_rad=rotation_rad)

    def move_by(
        self,
        distance_m: ArrayLike | None = None,
        turn_rad: ArrayLike | None = None,
        *,
        frame: str = "room",
        speed_m_s: float | None = None,
        wait: bool = True,
    ) -> None:
        """Move the platform by a distance (k,) and a rotation (c,) from its target or position.

        The axes of the motion are those of `frame`, "room" or "platform". All else is as in
        `move_to`.
        """
        self._move(wait, speed_m_s, distance_m=distance_m, turn_rad=turn_rad, frame=frame)

    def _move(
        self, wait: bool, speed_m_s: float | None, frame: str | None = None, **to: ArrayLike | None
    ) -> None:
        """Move to the position and rotation in `to`, or by them, as its keys say."""
        if not self._k:
            raise Refused(f"{self.name} has no platform; use turn_to, turn_by or pay_out")
        sizes = (self._k, "coordinate, in m"), (self._c, "controlled angle, in rad")
        places = zip(to.items(), sizes, strict=True)
        given: dict[str, Any] = {
            key: self._vector(key, value, *size)
            for (key, value), size in places
            if value is not None
        }
        if not given:
            raise InvalidArgument(f"nothing to move; give {' or '.join(to)}")
        if frame is not None:
            given["frame"] = frame
        if speed_m_s is not None:
            given["speed_m_s"] = _positive("speed_m_s", speed_m_s)
        try:
            self._carry_out("pose", given, wait)
        except Refused as error:
            for key in ("position_m", "distance_m"):
                if np.abs(given.get(key, 0.0)).max() > _LIKELY_mm:
                    raise _reworded(error, f"{error}; {key} is in metres") from None
            raise

    # -- motion of single axes

    def turn_to(
        self, angle_rad: ArrayLike, *, speed_rad_s: float | None = None, wait: bool = True
    ) -> None:
        """Turn the motors to angles (n,), rad, as `angle_rad` counts them; nan leaves one alone.

        For robots without a platform, as `turn_by` and `jog`.
        """
        self._turn("position_rad", angle_rad, speed_rad_s, wait)

    def turn_by(
        self, distance_rad: ArrayLike, *, speed_rad_s: float | None = None, wait: bool = True
    ) -> None:
        """Turn the motors by angles (n,), rad; nan leaves one alone."""
        self._turn("distance_rad", distance_rad, speed_rad_s, wait)

    def pay_out(
        self, cable_m: ArrayLike, *, speed_rad_s: float | None = None, wait: bool = True
    ) -> None:
        """Pay out lengths of cable (n,), m, negative to wind it in; nan leaves one alone."""
        self._turn("cable_m", cable_m, speed_rad_s, wait)

    def _turn(self, key: str, value: ArrayLike, speed_rad_s: float | None, wait: bool) -> None:
        if self._k:
            raise Refused(f"{self.name} has a platform; use move_to or move_by")
        wanted: dict[str, Any] = {
            key: self._vector(key, value, len(self.axes), "axis", optional=True)
        }
        if speed_rad_s is not None:
            wanted["speed_rad_s"] = _positive("speed_rad_s", speed_rad_s)
        self._carry_out("pid", wanted, wait)

    def jog(self, velocity_rad_s: ArrayLike, duration_s: float) -> None:
        """Turn the motors at speeds (n,), rad/s, for a time; then they brake and hold."""
        self._jog("velocity_rad_s", velocity_rad_s, "axis, in rad/s", duration_s)

    def jog_cable(self, velocity_m_s: ArrayLike, duration_s: float) -> None:
        """Pay out cable at speeds (n,), m/s, negative to wind it in, for a time, as `jog`."""
        self._jog("cable_velocity_m_s", velocity_m_s, "axis, in m/s", duration_s)

    def _jog(self, key: str, value: ArrayLike, each: str, duration_s: float) -> None:
        wanted = {
            key: self._vector(key, value, len(self.axes), each),
            "timeout_s": _JOG_TIMEOUT_S,
            "duration_s": _positive("duration_s", duration_s),
        }
        with _HeldOnError(self, Refused, InvalidArgument):
            self._start("jog", wanted)
            with _HeldOnError(self):
                while not is_done(self._running("jog")):
                    self._backend.wait(_RENEW_S)
                    self._running("jog")
                    self._backend.command("set", wanted=wanted)
                self._settle("jog")
        self.hold()

    # -- motion of any robot

    def follow(self, path: str | Path) -> None:
        """Plan and follow the path in a file: way points (.toml, .csv) or G-code, in the room.

        The whole path is planned before anything moves. The call also returns when the path waits;
        `resume` continues it. Raises Refused if the path needs more than one plan, or if the robot
        cannot follow it; the message then gives the line.
        """
        file = path_of("path", path)
        if not file.is_file():
            raise InvalidArgument(f"{file}: no such file")
        self.run("path", plan=self._backend.plan(file))

    @contextmanager
    def stream(self, scale: float = 1.0) -> Iterator[Callable[[ArrayLike], None]]:
        """Follow an input device within the block, then hold; yield a function for its position.

        Call the function 30 to 60 times a second with (k,) coordinates in m, and `wait` in between.
        The platform copies the motion from the first position on, multiplied by `scale`. It stops
        if no position arrives for 0.5 s. If the robot has no platform, the coordinates are the
        cable lengths that the first winches, at most three, pay out. Raises Refused if the daemon
        has no stream.
        """
        factor, k = _positive("scale", scale), self._k or min(3, len(self.axes))
        with self._backend.open_stream() as send_packet, _HeldOnError(self, Refused):

            def send(position_m: ArrayLike) -> None:
                position = self._vector("position_m", position_m, k, "coordinate, in m")
                send_packet([*cast(list[float], position), 0.0, 0.0][:3], factor)

            program = "pose" if self._k else "follow"
            self._start(program, {"stream": True} if self._k else {})
            yield send
            self.hold()

    def run(self, program: str, /, **arguments: Any) -> None:
        """Run a program with its arguments until it is done; `hold` and `idle` return immediately.

        The reference page "Programs" lists the programs and their arguments.
        """
        self._carry_out(_plain("program", program), arguments)

    def hold(self) -> None:
        """Stop any motion and hold the position with power; `resume` continues it."""
        self._backend.command("hold")
        self._started = ""

    def resume(self) -> None:
        """Continue the motion or path that a hold interrupted."""
        self.run("path" if self._progress().get("path") else "pose", resume=True)

    def wait(self, seconds: float) -> None:
        """Let this time pass on the robot's clock, s; raises Faulted if a fault removes power."""
        seconds = _duration(seconds)
        with _HeldOnError(self):
            powered = self.state == "active"
            for part in range(math.ceil(round(seconds / _RENEW_S, 6))):
                self._backend.wait(min(_RENEW_S, seconds - part * _RENEW_S))
                self._require_power(powered, self._look())

    def observe(self, seconds: float) -> Row:
        """Wait as `wait` does; return the cycles received meanwhile, (cycles,), at least two.

        A daemon sends some 50 per second, with only `time_s`, `position_rad`, `cable_length_m` and
        `tension_N`.
        """
        seconds = _duration(seconds)
        with _HeldOnError(self):
            powered = self.state == "active"
            rows = self._backend.observe(seconds)
            self._require_power(powered, self._look())
        return rows

    def wait_until_done(self) -> None:
        """Wait until the last started motion is done. Raises Faulted and MotionEnded."""
        program = self._started
        if not program:
            return
        with _HeldOnError(self):
            while not is_done(progress := self._running(program)):
                self._backend.wait(self._backend.look_s)
            if program == "jog" or not self._k:  # it moves single axes
                self._settle(program)
        self._started = ""
        if (trouble := progress.get("trouble")) and self.on_status is None:
            warnings.warn(str(trouble), RuntimeWarning, stacklevel=_level_of_script())

    def inject_fault(
        self, axis: str | int | np.integer[Any], fault: str, value: int | None = None
    ) -> None:
        """Inject a fault into a simulated axis, given by name or index from 0; "mend" repairs it.

        Faults and values are those of `cdpr sim fault`, such as "drive-fault" and "cut-cable".
        """
        if isinstance(axis, str) and axis in self.axes:
            axis = self.axes.index(axis)
        if not isinstance(axis, int | np.integer) or not 0 <= axis < len(self.axes):
            names = ", ".join(map(repr, self.axes))
            raise InvalidArgument(f"axis: {axis!r}; allowed: 0 to {len(self.axes) - 1}, or {names}")
        self._backend.inject_fault(int(axis), _plain("fault", fault), _plain("value", value))

    # -- helpers

    def _carry_out(self, program: str, wanted: Mapping[str, Any], wait: bool = True) -> None:
        # `wait_until_done` handles the other errors
        with _HeldOnError(self, Refused, InvalidArgument):
            self._start(program, {key: _plain(key, value) for key, value in wanted.items()})
            if wait:
                self.wait_until_done()

    def _start(self, program: str, wanted: Mapping[str, Any]) -> None:
        before, self._started = self._started, program
        try:
            self._backend.command("program", program, wanted)
        except (Refused, InvalidArgument) as refused:
            self._started = before
            status = self._backend.brief_status()  # not for `on_status`: nothing has started
            if not isinstance(refused, Refused):
                raise
            if status["reacting"] != "none":
                error = self._fault(status)  # the robot is stopping
                if isinstance(error, Faulted):
                    raise error from None
            if (text := _text_for_script(refused, status["state"])) == str(refused):
                raise
            raise _reworded(refused, text) from None
        if program in _STANDING:
            self._started = ""

    def _progress(self) -> dict[str, Any]:
        return self.status.get("program_progress") or {}

    def _axis_values(self, field: str) -> FloatArray:
        return np.array([_number(axis.get(field)) for axis in self.status["axes"]], float)

    def _running(self, program: str) -> dict[str, Any]:
        """Return the progress of a program; raises Faulted or MotionEnded if it has ended."""
        status = self._look()
        if status["state"] != "active" or status["reacting"] != "none":
            raise self._fault(status)
        progress: dict[str, Any] = status.get("program_progress") or {}
        if status["program"] != program:
            self._started = ""
            raise MotionEnded(f"{program} was ended: {end_text(status)}")
        if progress.get("trouble") and progress.get("done") != 1.0:
            raise MotionEnded(f"{program}: {progress['trouble']}")
        return progress

    def _look(self) -> Mapping[str, Any]:
        if self.on_status is None:
            return self._backend.brief_status()
        status = self.status
        self.on_status(status)
        return status

    def _require_power(self, powered: bool, status: Mapping[str, Any]) -> None:
        if powered and (status["state"] != "active" or status["reacting"] != "none"):
            raise self._fault(status)

    def _settle(self, program: str) -> None:
        """Wait until the motors have reached their set-points, up to a time limit."""
        waited_s = 0.0
        while waited_s < _SETTLE_S and not all(map(is_at_rest, self.status["axes"])):
            self._backend.wait(self._backend.look_s)
            waited_s += self._backend.look_s
            self._running(program)

    def _fault(self, status: Mapping[str, Any]) -> Error:
        """Wait until the reaction to a fault has ended; return the error to raise."""
        self._started = ""
        most_s = _REACTION_S + float(self.description.get("lowering_s", 0.0))
        waited_s = 0.0
        while status["reacting"] != "none" or status["busy"]:
            if waited_s > most_s:
                break
            self._backend.wait(_RENEW_S)
            waited_s += _RENEW_S
            status = self._look()
        status = self.status
        if status["state"] == "ready":
            return MotionEnded(f"the power was removed: {status['reason'] or 'by a command'}")
        details = status.get("reason_limit") or {}
        axis = details.get("axis")
        name = None
        if isinstance(axis, int) and 0 <= axis < len(self.axes):
            name = self.axes[axis]
        return Faulted(str(status["reason"]), details.get("limit"), name)

    def _vector(
        self, name: str, value: ArrayLike, size: int, each: str, optional: bool = False
    ) -> list[float | None]:
        """Return numbers as a list, with None for nan if `optional`; raises InvalidArgument."""
        try:
            numbers = real_array(value)
        except (TypeError, ValueError):
            raise InvalidArgument(
                f"{name}: {value!r}; allowed: {size} numbers, one for each {each}"
            ) from None
        if not size:
            raise InvalidArgument(f"{name}: {self.name} has no {each.partition(',')[0]}; omit it")
        if numbers.shape != (size,):
            raise InvalidArgument(
                f"{name}: shape {numbers.shape}; allowed: ({size},), one number for each {each}"
            )
        bad = np.isinf(numbers) if optional else ~np.isfinite(numbers)
        if bad.any():
            place = int(bad.argmax())
            raise InvalidArgument(f"{name}[{place}]: {numbers[place]}; allowed: a finite number")
        return [None if math.isnan(number) else number for number in numbers.tolist()]


class _HeldOnError:
    """Holds the robot if an error, such as a Ctrl-C, leaves the block during a motion.

    After a Ctrl-C outside a `with` block nothing would close the handle, so the power is removed.
    Errors of the types `but` do not hold the robot. Nor do errors after a fault or another client
    has ended the motion.
    """

    def __init__(self, robot: Robot, *but: type[Error]) -> None:
        self._robot = robot
        self._but = but

    def __enter__(self) -> None:
        pass

    def __exit__(self, _kind: Any, error: BaseException | None, _traceback: Any) -> None:
        if error is None or isinstance(error, self._but):
            return
        robot = self._robot
        try:
            if isinstance(error, KeyboardInterrupt) and not robot._in_block:
                robot.disable()
            elif robot._started:
                robot.hold()
        except Error as failed:
            note = f"the robot could not be stopped: {failed}"
            if str(failed) != str(error) and note not in getattr(error, "__notes__", ()):
                error.add_note(note)


def end_text(status: Mapping[str, Any]) -> str:
    """Return why a program no longer runs: a fault, a hold, or another command."""
    return str(status["reason"] or status.get("commanded") or f"{status['program']} runs")


def is_done(progress: Mapping[str, Any]) -> bool:
    """Whether a program is done: a sweep after its last leg, a path also while it waits."""
    if path := progress.get("path"):
        over = progress.get("done") == 1.0 and path.get("time_s") == path.get("duration_s")
        return over or path.get("waiting") in _STANDS
    return progress.get("done") == 1.0 and progress.get("leg") == progress.get("legs")


def is_at_rest(axis: Mapping[str, Any]) -> bool:
    """Whether a motor has stopped at its set-point, according to the axis's part of a status."""
    angle, speed = _number(axis.get("position_rad")), _number(axis.get("velocity_rad_s"))
    off = abs(angle - _number(axis.get("setpoint_rad")))
    return not (off > _REST_RAD or abs(speed) > _REST_RAD_S)


def path_of(name: str, value: str | Path) -> Path:
    """Return a user's path; raises InvalidArgument."""
    try:
        return Path(value)
    except TypeError:
        raise InvalidArgument(f"{name}: {value!r}; allowed: a path") from None


def texts_of(name: str, value: str | Sequence[str]) -> list[str]:
    """Return the texts that a user gives, one or several; raises InvalidArgument."""
    texts = [value] if isinstance(value, str) else value
    if not isinstance(texts, Sequence) or not all(isinstance(text, str) for text in texts):
        raise InvalidArgument(f"{name}: {value!r}; allowed: a text, or a list of texts")
    return list(texts)


def number_in(name: str, value: float, low: float, high: float, unit: str = "") -> float:
    """Return a user's number if it is within bounds; raises InvalidArgument."""
    number = _finite(value)
    if not low <= number <= high:
        raise InvalidArgument(f"{name}: {value!r}; allowed: {low:g} to {high:g}{unit}")
    return number


def _positive(name: str, value: float) -> float:
    number = _finite(value)
    if not number > 0.0:
        raise InvalidArgument(f"{name}: {value!r}; allowed: a finite number above 0")
    return number


def _duration(value: float) -> float:
    number = _finite(value)
    if not number >= 0.0:
        raise InvalidArgument(f"seconds: {value!r}; allowed: a finite number from 0")
    return number


def _finite(value: float) -> float:
    """Return a finite number, or nan."""
    try:
        number = float(value)
    except (TypeError, ValueError):
        return math.nan
    return number if math.isfinite(number) else math.nan


def _plain(name: str, value: Any) -> Any:
    """Return an argument of a command as plain JSON values; raises InvalidArgument."""
    try:
        return json.loads(json.dumps(value, allow_nan=False, default=lambda array: array.tolist()))
    except (AttributeError, RecursionError, TypeError, ValueError):
        raise InvalidArgument(
            f"{name}: {value!r}; allowed: texts, finite numbers, lists of these"
        ) from None


def _reworded(refused: Refused, text: str) -> Refused:
    made = Refused(text, refused.refusal)
    made.origin = refused.origin
    return made


def _text_for_script(refused: Refused, state: str) -> str:
    """Return the text of a refusal with the next step, or with places in the units of a script."""
    if (refusal := refused.refusal) is None:
        return str(refused)
    if refusal.code is RefusalCode.NOT_IN_STATE and state in _NEXT:
        return f"{refusal}; {_NEXT[state]}"
    return refusal.in_si() if "why_si" in refusal.arguments else str(refused)


def _level_of_script() -> int:
    """Return the `stacklevel` with which a warning of this module names the script's line."""
    frame, level = inspect.currentframe(), 0
    while frame is not None and frame.f_code.co_filename == __file__:
        frame, level = frame.f_back, level + 1
    return level


def _number(value: float | None) -> float:
    return math.nan if value is None else float(value)


def _numbers(values: Any, size: int) -> FloatArray:
    if not values:
        return np.full(size, math.nan)
    return np.array([_number(value) for value in values], float)
