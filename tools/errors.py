"""How a command ends when it cannot do its work, and what the shell is told."""

from collections.abc import Iterator
from contextlib import contextmanager

DONE, FAILED, BAD_INPUT = 0, 1, 2


class CommandError(Exception):
    """A command ends early; `exit_status` goes to the shell, the message to the user."""

    exit_status = FAILED


class WorkFailedError(CommandError):
    """The work was begun and failed: a drive fault, a limit, a lost bus."""


class BadInputError(CommandError):
    """The command cannot begin: a wrong argument, file, profile or bus."""

    exit_status = BAD_INPUT


@contextmanager
def os_error_as(kind: type[CommandError], what: str) -> Iterator[None]:
    """Raise a `kind` that says of `what` why the system refuses it, in place of an OSError."""
    try:
        yield
    except OSError as error:
        raise kind(f"{what}: {error.strerror or error}") from error


@contextmanager
def raised_as(kind: type[CommandError], error: type[Exception]) -> Iterator[None]:
    """Raise a `kind` in place of such an error, with its text."""
    try:
        yield
    except error as raised:
        raise kind(str(raised)) from raised
