"""The `cdpr` command: its subcommands, and how errors become a message and an exit status."""

from __future__ import annotations

import atexit
import json
import re
import signal
import sys
import threading
from contextlib import suppress
from typing import Annotated, Any, NoReturn

import typer
from typer import BadParameter
from typing_extensions import override

from cdpr_drivers.errors import ConfigurationError, DriverError
from cdpr_profiles.errors import ProfileError, printable
from cdpr_rt.errors import ControlError, InvalidRequestError
from cdpr_sim_bus.errors import BusSetupError, SimulatorError
from cdpr_tools.command_group import ROBOT_VARIABLE, group_of
from cdpr_tools.compiling import announce_compiling
from cdpr_tools.errors import BAD_INPUT, DONE, FAILED, BadInputError, CommandError
from cdpr_tools.streams import (
    OutputLostError,
    end_with_stdin,
    guard_streams,
    procedure_token,
)

MODULES = {
    "commission": {
        "commission": "Measure, identify, validate and report motors, each detached from its load.",
    },
    "doctor": {
        "doctor": "Check this machine, and list what to fix before it runs a robot.",
    },
    "estop": {
        "estop": "Remove the power from a robot's drives immediately: no braking, no lowering.",
    },
    "run": {
        "run": "Start a robot's control loop as a daemon. The motors get no power until you "
        "enable them.",
        "demo": "Start a simulated robot and open its page in a browser.",
    },
    "service_unit": {
        "service-unit": "Print a systemd unit that runs the robot's daemon.",
    },
    "daemon_motion": {
        "jog": "Turn axes at a constant speed for a while, or move a platform by one step.",
        "move": "Move axes or the platform to a position and wait until they are there.",
        "controller": "Run a program (a controller with its motion) until it is done, then hold.",
        "tighten": "Tighten the cables, measure where the platform is, and hold it.",
        "lower": "Lower the platform onto its stand and slacken the cables; the power stays on.",
        "resume": "Continue the move or path that was stopped by `cdpr hold` or Ctrl-C.",
    },
    "daemon_state": {
        "status": "Show the state of the daemon and its robot.",
        "page": "Print the address of the robot's page for a browser, or open it.",
        "check": "Boot the drives again and check the bus, without power.",
        "enable": "Switch the drives on; they hold their position.",
        "disable": "Stop the motion under control, then switch the drives off.",
        "hold": "Stop the motion and hold the position under power; `cdpr resume` continues it.",
        "ack": "Acknowledge a fault after its cause has been removed; the power stays off.",
        "stop": "Stop the motion under control, switch the drives off and end the daemon.",
    },
    "bench": {
        "bench": "Measure the cost of this software on this machine.",
    },
    "bus": {
        "bus": "Look at the traffic and the devices of a CAN bus.",
    },
    "calibrate": {
        "calibrate": "Calibrate a robot's geometry, drums and elongation.",
    },
    "camera": {
        "camera": "Take images with a camera and calibrate its lens.",
    },
    "cogging": {
        "cogging": "Identify, check and report the cogging torque of a motor.",
    },
    "groups": {
        "drive": "Set up and try one drive.",
        "robot": "Describe a cable robot, check it, and try it in simulation.",
        "sim": "Simulate drives, robots, cameras and faults.",
    },
    "import_recordings": {
        "import": "Convert recordings of other programs: CSV, OptiTrack, Vicon, candump, MCAP.",
    },
    "io": {
        "io": "Show and test the safety I/O.",
    },
    "log": {
        "log": "List, plot and export recordings.",
    },
    "markers": {
        "markers": "Print camera markers and measure a map of them.",
    },
    "poses": {
        "poses": "Draw random poses that a robot can reach.",
    },
    "path": {
        "path": "Check, run and resume paths from G-code or way points.",
    },
    "profiles": {
        "profiles": "List and show the profiles of motors, drives, cables, winches and robots.",
    },
    "rail": {
        "rail": "Move the rails that carry the winches.",
    },
    "teleop": {
        "teleop": "Move a robot by keyboard, gamepad or script.",
    },
    "tension": {
        "tension": "Read, tare and calibrate load cells.",
    },
}
PANELS = {
    "Run": ("run", "page", "status", "check", "enable", "ack", "service-unit"),
    "Move": ("tighten", "move", "jog", "path", "controller", "teleop", "resume"),
    "Stop": ("hold", "lower", "disable", "stop", "estop"),
    "Look": ("log", "bus", "import"),
    "Describe": ("robot", "profiles"),
    "Commission": ("commission", "drive", "cogging", "tension", "io", "rail"),
    "Calibrate": ("calibrate", "camera", "markers", "poses"),
    "Simulate": ("demo", "sim"),
    "Machine": ("doctor",),
}
"""Commands that the help shows, by their headings. The help hides all other commands."""
ALIASES = {
    "clear": "ack",
    "reset": "ack",
    "start": "run",
    "pause": "hold",
    "robot list": "profiles list robots",
    "robot check": "robot show",
}
"""Words that users of other controllers type, and the command that runs instead. That command never
moves the robot.
"""
GUESSES = {
    "goto": "this moves the robot: type `cdpr move --to X Y [Z]`",
    "home": "this moves the robot: `cdpr lower` puts the platform on its stand",
    "path check": "type `cdpr path show FILE`",
    "move --by": "type `cdpr move --relative --to X Y [Z]`, in mm",
    "gui": "`cdpr page` prints the address of a running robot's page for a browser, and "
    "`cdpr run ROBOT --open` starts a robot and opens it",
}
"""Words that users type for commands that move the robot or do not exist, and the answer."""
STOPS = """Which stop do I want? In danger: the emergency-stop button, no command.

hold     brake; the motors hold the position           power stays on
Ctrl-C   of move, jog, path or teleop: as hold         power stays on
lower    put the platform on its stand, cables loose   power stays on
disable  brake and lower the platform                  then power off
stop     as disable, then end the daemon               then power off
Ctrl-C   of run: as stop; a second one: as estop
estop    no braking: a raised platform falls           power off immediately"""
"""Ends the help of every command that stops."""
_HINTS = f"""Name the robot by --robot ROBOT in any command, or once for all by the environment
variable {ROBOT_VARIABLE}. `cdpr stop --help` compares the ways to stop."""
_INTERRUPTED = 130
_MOST_CHARS = 10_000
"""Longest error message, in characters."""
_BAD_INPUTS = (ProfileError, BusSetupError, ConfigurationError, InvalidRequestError)

_WORDS = (
    (r"Input should be less than or equal to (\S+)", r"allowed: up to \1"),
    (r"Input should be greater than or equal to (\S+)", r"allowed: \1 or more"),
    (r"Input should be a valid integer.*", "allowed: a whole number"),
    (r"Input should be a valid number.*", "allowed: a number"),
    (r"Value error, (.*) is not one of (.*)\.", r"\1; allowed: \2"),
)
"""The library's texts for values that are not allowed, and their replacements here."""
# typer does not export them
_UsageError: Any = BadParameter.__base__
_CommandLineError: Any = _UsageError.__base__


class _Commands(group_of(MODULES, PANELS, dict.fromkeys(PANELS["Stop"], STOPS))):  # type: ignore[misc]
    """All commands; errors in their arguments are reported like all other errors."""

    @override
    def resolve_command(self, ctx: Any, args: list[str]) -> Any:
        for words in () if ctx.resilient_parsing else (" ".join(args[:2]), args[0]):
            if words in GUESSES:
                raise BadInputError(f"{words}: {GUESSES[words]}")
            if words in ALIASES:
                print(f"this is `cdpr {ALIASES[words]}`", file=sys.stderr)
                args = [*ALIASES[words].split(), *args[len(words.split()) :]]
                break
        return super().resolve_command(ctx, args)

    @override
    def invoke(self, ctx: Any) -> Any:
        try:
            return super().invoke(ctx)
        except _UsageError as error:
            if isinstance(error, BadParameter):
                if getattr(error.param, "envvar", None) == ROBOT_VARIABLE and not error.message:
                    error.message = f"Name it, or set {ROBOT_VARIABLE}"
                for pattern, words in _WORDS:
                    error.message = re.sub(pattern, words, error.message)
            elif "unexpected extra argument" in error.message and _names_robot(error.ctx.command):
                error.message += "; name the robot with --robot"
            error.message = printable(error.message)
            raise


def _names_robot(command: Any) -> bool:
    return any("--robot" in param.opts for param in command.params)


app = typer.Typer(
    cls=_Commands,
    name="cdpr",
    epilog=" ".join(_HINTS.split()),
    help="Commission, run and simulate the winches of cable-driven parallel robots.",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
)


def _tell_version(asked: bool) -> None:
    if asked:
        # imported here: it takes longer than the help
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
    """Return the exit status of a command that `error` has ended."""
    if isinstance(error, CommandError):
        return error.exit_status
    return BAD_INPUT if isinstance(error, _BAD_INPUTS) else FAILED


def main() -> None:
    """Run the command line; a known error is one line on standard error, never a traceback."""
    guard_streams()
    if procedure_token is not None:
        threading.Thread(target=end_with_stdin, daemon=True).start()
    announce_compiling()
    try:
        try:
            status = app(standalone_mode=False, prog_name="cdpr")
        finally:
            sys.stdout.flush()  # here a failure can still be reported
    except BrokenPipeError:
        sys.exit(FAILED)
    except _CommandLineError as error:
        if not (text := error.format_message()):  # the help was shown instead
            sys.exit(BAD_INPUT)
        _end(_with_help(text, getattr(error, "ctx", None)), BAD_INPUT)
    except (CommandError, ControlError, DriverError, ProfileError, SimulatorError) as error:
        notes = getattr(error, "__notes__", ())
        figures = getattr(error, "figures", {})
        _end("; ".join([str(error), *notes]), exit_status(error), figures)
    except ModuleNotFoundError as error:
        if not error.name or error.name.startswith("cdpr_"):
            raise
        extra = "camera" if error.name == "cv2" else "daemon"
        _end(f"needs {error.name}, which comes with: pip install 'cdpr-rt[{extra}]'", FAILED)
    except (KeyboardInterrupt, typer.Abort):  # while libraries are loading, or at a question
        _end("interrupted", FAILED)
    finally:
        # all work is done: a Ctrl-C while the interpreter ends would only show a traceback
        atexit.register(signal.signal, signal.SIGINT, signal.SIG_IGN)
    if status == _INTERRUPTED:
        _end("interrupted", FAILED)
    sys.exit(status or DONE)


def _with_help(text: str, context: Any) -> str:
    """Return a message about the command line as one line that also names where to find help."""
    text = " ".join(text.split()).removesuffix(".")
    if context is None or text.endswith("?") or "allowed: " in text:
        return text
    return f"{text}; see `{context.command_path} --help`"


def _end(message: str, status: int, figures: dict[str, Any] | None = None) -> NoReturn:
    message = message if len(message) <= _MOST_CHARS else f"{message[:_MOST_CHARS]}..."
    text = f"cdpr: {printable(message)}"
    if sys.stderr.isatty():
        from cdpr_tools.output import fold, width_of  # noqa: PLC0415  # slow to load

        text = fold(text, width_of(sys.stderr))
    print(text, file=sys.stderr)
    if "--json" in sys.argv:
        with suppress(OutputLostError, BrokenPipeError):
            result = {**(figures or {}), "ok": False, "error": message, "exit_status": status}
            print(json.dumps(result), flush=True)
    sys.exit(status)


if __name__ == "__main__":
    main()
