"""The `cdpr` command: its subcommands, and how errors become a message and an exit status."""

from __future__ import annotations

import importlib
import sys
from functools import cache
from typing import NoReturn

import typer

from cdpr_rt.errors import ControlError
from drivers.errors import DriverError
from profiles.errors import ProfileError
from sim_bus.errors import BusSetupError, SimulatorError
from tools.errors import BAD_INPUT, DONE, FAILED, CommandError
from tools.output import to_json

app = typer.Typer(
    name="cdpr",
    help="Commission, run and simulate the winches of cable-driven parallel robots.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
)

_COMMANDS = (
    "bench",
    "bus",
    "cogging",
    "commission",
    "doctor",
    "drive",
    "estop",
    "io",
    "log",
    "profiles",
    "rail",
    "robot",
    "run",
    "service-unit",
    "sim",
    "teleop",
    "tension",
)
_OF_A_DAEMON = {
    "daemon_motion": ("controller", "jog", "move"),
    "daemon_platform": ("lower", "pause", "resume", "tighten"),
    "daemon_state": ("ack", "check", "disable", "enable", "hold", "status", "stop"),
}
_MODULES = {name: name.replace("-", "_") for name in _COMMANDS} | {
    name: module for module, names in _OF_A_DAEMON.items() for name in names
}
_INTERRUPTED = 130


@app.callback()
def _group() -> None:
    """Commission, run and simulate the winches of cable-driven parallel robots."""


def _register(arguments: list[str]) -> None:
    """Load the commands; only the one that is asked for, since each brings libraries along."""
    asked = _MODULES.get(arguments[0]) if arguments else None
    for module in [asked] if asked else dict.fromkeys(_MODULES.values()):
        _load(module)


@cache
def _load(module: str) -> None:
    """Add the commands of a module, once however often `main` runs in this process."""
    importlib.import_module(f"tools.commands.{module}").register(app)


def _exit_status(error: BaseException) -> int:
    if isinstance(error, CommandError):
        return error.exit_status
    return BAD_INPUT if isinstance(error, ProfileError | BusSetupError) else FAILED


def main() -> None:
    """Run the command line; a known error is one line on standard error, never a traceback."""
    try:
        _register(sys.argv[1:])
        app(standalone_mode=True)
    except (CommandError, ControlError, DriverError, ProfileError, SimulatorError) as error:
        notes = getattr(error, "__notes__", ())
        _end("; ".join([str(error), *notes]), _exit_status(error))
    except KeyboardInterrupt:  # while libraries are loaded
        _end("interrupted", FAILED)
    except SystemExit as end:
        # how the command line library passes an interrupt on
        if end.code == _INTERRUPTED:
            _end("interrupted", FAILED)
        raise
    sys.exit(DONE)


def _end(message: str, status: int) -> NoReturn:
    print(f"cdpr: {message}", file=sys.stderr)
    if "--json" in sys.argv:
        print(to_json({"ok": False, "error": message, "exit_status": status}))
    sys.exit(status)


if __name__ == "__main__":
    main()
