"""How a command ends if it cannot do its work, and its exit status."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

DONE, FAILED, BAD_INPUT = 0, 1, 2


class CommandError(Exception):
    """A command ends early; `exit_status` is for the shell, the message for the user."""

    exit_status = FAILED

    def __init__(self, text: str, /, **figures: Any) -> None:
        super().__init__(text)
        self.figures = figures
        """Shown with --json, beside the text."""


class WorkFailedError(CommandError):
    """The work was started and failed: a drive fault, a limit, a lost bus."""


class NoDaemonError(WorkFailedError):
    """No daemon answers."""


class ConnectionLostError(NoDaemonError):
    """The connection ended before the answer."""


class UnansweredError(NoDaemonError):
    """The answer has not arrived in time."""


class CrowdedError(NoDaemonError):
    """The daemon has too many connections and has not read the request."""


class ServiceRefusalError(WorkFailedError):
    """The service has refused a command, for example because another client may move the robot."""


class LoopEndedError(WorkFailedError):
    """The daemon's control loop has ended."""


class BadInputError(CommandError):
    """The command cannot start: a wrong argument, file, profile or bus."""

    exit_status = BAD_INPUT


@contextmanager
def os_error_as(kind: type[CommandError], what: str) -> Iterator[None]:
    """Replace an OSError in the block by a `kind` with `what` and the system's reason."""
    try:
        yield
    except OSError as error:
        raise kind(f"{what}: {error.strerror or error}") from error


@contextmanager
def raised_as(kind: type[CommandError], error: type[Exception]) -> Iterator[None]:
    """Replace an error of this type in the block by a `kind` with the same text."""
    try:
        yield
    except error as raised:
        raise kind(str(raised)) from raised
