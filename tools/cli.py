"""The `cdpr` command: its subcommands, and how errors become a message and an exit status."""

from __future__ import annotations

import atexit
import json
import re
import signal
import sys
from typing import Annotated, Any, NoReturn

import typer
from typer import BadParameter
from typing_extensions import override

from cdpr_drivers.errors import ConfigurationError, DriverError
from cdpr_profiles.errors import ProfileError
from cdpr_rt.errors import ControlError, InvalidRequestError
from cdpr_sim_bus.errors import BusSetupError, SimulatorError
from cdpr_tools.command_group import group_of
from cdpr_tools.compiling import announce_compiling
from cdpr_tools.errors import BAD_INPUT, DONE, FAILED, CommandError

MODULES = {
    "commission": {
        "commission": "Measure, identify, validate and report motors, each detached from its load.",
    },
    "doctor": {
        "doctor": "Check this machine and tell what to fix before a robot runs on it.",
    },
    "daemon.estop": {
        "estop": "Take the power from a robot's drives at once: no braking, no lowering; brakes "
        "are applied.",
    },
    "daemon.run": {
        "run": "Run a robot's control loop as a daemon; it stands ready, without power, until "
        "enabled.",
    },
    "daemon.service_unit": {
        "service-unit": "Print a systemd unit that runs the robot's daemon; takes the options of "
        "`cdpr run` as well.",
    },
    "daemon.daemon_motion": {
        "jog": "Turn axes at a speed for a while; they stop when this command does, however it "
        "ends.",
        "move": "Move axes or the platform to positions and wait; Ctrl-C holds and exits with 1.",
        "controller": "Change over to a program and stay with it until it is done; hold follows "
        "then.",
        "tighten": "Take up the slack of a platform's cables and learn where it is; it is held "
        "then.",
        "lower": "Let the platform down onto its stand; the power stays on, the cables are loose.",
        "pause": "Stop the platform and hold it there; `resume` goes on.",
        "resume": "Go on to the position, or along the path, that was left when it was paused.",
    },
    "daemon.daemon_state": {
        "status": "Show the state of a daemon and its robot; changes nothing.",
        "check": "Boot the drives anew and check the bus without power; ready afterwards.",
        "enable": "Give the drives power; they hold where they are.",
        "disable": "Stop the motion under control, then take the power off.",
        "hold": "Stop the motion and stay there, whoever moves; the power stays on.",
        "ack": "Acknowledge a fault whose cause is gone; nothing gets power by it.",
        "stop": "End the daemon: the motion stops under control, the power goes off.",
    },
    "bench": {
        "bench": "Measure this project's own cost on this machine.",
    },
    "bus": {
        "bus": "Look at a CAN bus.",
    },
    "calibration.calibrate": {
        "calibrate": "Calibrate a robot's geometry, drums and elongation.",
    },
    "calibration.camera": {
        "camera": "Cameras: images, and intrinsics.",
    },
    "cogging": {
        "cogging": "Cogging: sweep, fit, validate, report.",
    },
    "drive.group": {
        "drive": "One drive on the bus.",
    },
    "devices.io": {
        "io": "The safety I/O beside the drives.",
    },
    "log": {
        "log": "The daemon's recordings: what is in them, as tables and pictures.",
    },
    "calibration.markers": {
        "markers": "Printed markers: sheets, and maps of them.",
    },
    "robot.poses": {
        "poses": "Draw poses that a robot reaches straight from home, or from another place.",
    },
    "robot.path": {
        "path": "Preview a path, follow it on the running daemon, resume it.",
    },
    "profiles": {
        "profiles": "Profiles of motors, drives, cables, winches and robots.",
    },
    "devices.rail": {
        "rail": "The rails on which winches stand.",
    },
    "robot.group": {
        "robot": "Describe a cable robot, look at it, try it.",
    },
    "sim.sim": {
        "sim": "Simulated winches on a CAN bus.",
    },
    "daemon.teleop": {
        "teleop": "Lead a robot by hand: `cdpr teleop ROBOT` means `cdpr teleop robot ROBOT`.",
    },
    "tension": {
        "tension": "Cable tensions: watch, tare, calibrate.",
    },
}
_INTERRUPTED = 130
_BAD_INPUTS = (ProfileError, BusSetupError, ConfigurationError, InvalidRequestError)

_WORDS = (
    (r"Input should be less than or equal to (\S+)", r"allowed: up to \1"),
    (r"Input should be greater than or equal to (\S+)", r"allowed: \1 or more"),
    (r"Input should be a valid integer.*", "allowed: a whole number"),
    (r"Input should be a valid number.*", "allowed: a number"),
    (r"Value error, (.*) is not one of (.*)\.", r"\1; allowed: \2"),
)
"""What the library says of a value that is not allowed, and how it is said here."""
_UsageError: Any = BadParameter.__base__  # typer does not export it


class _Commands(group_of(MODULES)):  # type: ignore[misc]
    """All commands; what is wrong with their arguments is told as everything else is."""

    @override
    def invoke(self, ctx: Any) -> Any:
        try:
            return super().invoke(ctx)
        except _UsageError as error:
            if isinstance(error, BadParameter):
                for pattern, words in _WORDS:
                    error.message = re.sub(pattern, words, error.message)
            elif "unexpected extra argument" in error.message and _names_robot(error.ctx.command):
                error.message += "; a robot is named by --robot"
            raise


def _names_robot(command: Any) -> bool:
    return any("--robot" in param.opts for param in command.params)


app = typer.Typer(
    cls=_Commands,
    name="cdpr",
    help="Commission, run and simulate the winches of cable-driven parallel robots.",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
)


def _tell_version(asked: bool) -> None:
    if asked:
        # loaded here: it takes longer than the help
        from importlib.metadata import version  # noqa: PLC0415

        print(f"cdpr {version('cdpr-rt')}")
        raise typer.Exit


@app.callback()
def _group(
    _version: Annotated[
        bool,
        typer.Option(
            "--version", callback=_tell_version, is_eager=True, help="Show the version and exit."
        ),
    ] = False,
) -> None:
    """Commission, run and simulate the winches of cable-driven parallel robots."""


def exit_status(error: BaseException) -> int:
    """Return with what the command ends that `error` has ended."""
    if isinstance(error, CommandError):
        return error.exit_status
    return BAD_INPUT if isinstance(error, _BAD_INPUTS) else FAILED


def main() -> None:
    """Run the command line; a known error is one line on standard error, never a traceback."""
    announce_compiling()
    try:
        app(standalone_mode=True)
    except (CommandError, ControlError, DriverError, ProfileError, SimulatorError) as error:
        notes = getattr(error, "__notes__", ())
        _end("; ".join([str(error), *notes]), exit_status(error))
    except ModuleNotFoundError as error:
        if not error.name or error.name.startswith("cdpr_"):
            raise
        extra = "camera" if error.name == "cv2" else "daemon"
        _end(f"needs {error.name}, which comes with: pip install 'cdpr-rt[{extra}]'", FAILED)
    except KeyboardInterrupt:  # while libraries are loaded
        _end("interrupted", FAILED)
    except SystemExit as end:
        # how the command line library passes an interrupt on
        if end.code == _INTERRUPTED:
            _end("interrupted", FAILED)
        raise
    finally:
        # all is done or told: a Ctrl-C while the interpreter ends would end in its traceback
        atexit.register(signal.signal, signal.SIGINT, signal.SIG_IGN)
    sys.exit(DONE)


def _end(message: str, status: int) -> NoReturn:
    print(f"cdpr: {message}", file=sys.stderr)
    if "--json" in sys.argv:
        print(json.dumps({"ok": False, "error": message, "exit_status": status}))
    sys.exit(status)


if __name__ == "__main__":
    main()
