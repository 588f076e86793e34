"""How a command ends if it cannot do its work, and its exit status."""

from collections.abc import Iterator, Mapping
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


@contextmanager
def errors_for_scripts(arguments: Mapping[str, str]) -> Iterator[None]:
    """Raise errors in the block as those of `cdpr_rt`, with options replaced by `arguments`.

    An interrupted motion becomes KeyboardInterrupt.
    """
    from cdpr_drivers.errors import ConfigurationError, DriveFaultError, DriverError  # noqa: PLC0415
    from cdpr_profiles.errors import ProfileError  # noqa: PLC0415
    from cdpr_rt.errors import (  # noqa: PLC0415
        ControlError,
        InterruptedMotionError,
        InvalidRequestError,
        TripError,
    )
    from cdpr_rt.robot import Error, Faulted, InvalidArgument, InvalidRobot  # noqa: PLC0415  # slow

    try:
        yield
    except (CommandError, ControlError, DriverError, ProfileError) as error:
        text = str(error)
        for option, argument in arguments.items():
            text = text.replace(option, argument)
        why = error.__cause__ if isinstance(error, WorkFailedError) else error
        if isinstance(why, InterruptedMotionError):
            raise KeyboardInterrupt(text) from None
        raised: Error
        if isinstance(error, ProfileError):
            raised = InvalidRobot(text)
        elif isinstance(error, BadInputError | ConfigurationError | InvalidRequestError):
            raised = InvalidArgument(text)
        else:
            raised = (Faulted if isinstance(why, TripError | DriveFaultError) else Error)(text)
        for note in getattr(error, "__notes__", ()):
            raised.add_note(note)
        raise raised from None
