"""Errors of commands as errors of a robot's handle, which scripts catch, and the reverse."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from types import MappingProxyType
from typing import Final

from cdpr_drivers.errors import ConfigurationError, DriveFaultError, DriverError
from cdpr_profiles.errors import ProfileError
from cdpr_rt.code_loader import CodeError
from cdpr_rt.errors import (
    ControlError,
    InterruptedMotionError,
    InvalidRequestError,
    TripError,
)
from cdpr_rt.robot import Error, Faulted, InvalidArgument, InvalidRobot, NotRunning, Refused
from cdpr_tools.client.refusals import DaemonRefusalError
from cdpr_tools.errors import (
    BadInputError,
    CommandError,
    ConnectionLostError,
    CrowdedError,
    LoopEndedError,
    NoDaemonError,
    ServiceRefusalError,
    UnansweredError,
    WorkFailedError,
)

_NONE: Final[Mapping[str, str]] = MappingProxyType({})


@contextmanager
def errors_for_scripts(
    arguments: Mapping[str, str] = _NONE, *, opening: bool = False
) -> Iterator[None]:
    """Raise errors in the block as those of a handle, with options replaced by `arguments`.

    While a robot is `opening`, no command has been sent, and a wrong setting is one of its file. An
    interrupted motion becomes KeyboardInterrupt.
    """
    try:
        yield
    except (CommandError, ControlError, DriverError, ProfileError) as error:
        text = str(error)
        for option, argument in arguments.items():
            text = text.replace(option, argument)
        raised = _for_scripts(error, text, opening)
        for note in getattr(error, "__notes__", ()):
            raised.add_note(note)
        if isinstance(raised, Error):
            raised.origin = error
        raise raised from None


def _for_scripts(error: Exception, text: str, opening: bool) -> Error | KeyboardInterrupt:
    made: Error | KeyboardInterrupt
    match error:
        case NoDaemonError() if opening:
            made = NotRunning(text)
        case CrowdedError():
            made = Error(text)
        case ConnectionLostError() | UnansweredError():
            made = Error(f"{text}; the command may still be carried out")
        case NoDaemonError() | LoopEndedError():
            made = NotRunning(text)
        case DaemonRefusalError():
            made = Refused(text, error.refusal)
        case ServiceRefusalError():
            made = Refused(text)
        case ProfileError():
            made = InvalidRobot(text)
        case CodeError():
            made = InvalidArgument(text)
        case BadInputError() | ConfigurationError() | InvalidRequestError():
            made = (InvalidRobot if opening else InvalidArgument)(text)
        case WorkFailedError(__cause__=InterruptedMotionError()) | InterruptedMotionError():
            made = KeyboardInterrupt(text)
        case (
            WorkFailedError(__cause__=TripError() | DriveFaultError())
            | TripError()
            | DriveFaultError()
        ):
            made = Faulted(text)
        case _:
            made = Error(text)
    return made


@contextmanager
def robot_errors() -> Iterator[None]:
    """Raise errors of a robot's handle in the block as errors of the command."""
    try:
        yield
    except Error as error:
        raise command_error(error) from None


def command_error(error: Error) -> CommandError:
    """Return the command's error for an error of the handle: the CommandError behind it, if any."""
    cause = error.origin
    if not isinstance(cause, CommandError):
        bad = isinstance(error, InvalidArgument)
        cause = (BadInputError if bad else WorkFailedError)(str(error))
    for note in getattr(error, "__notes__", ()):
        if note not in getattr(cause, "__notes__", ()):
            cause.add_note(note)
    return cause
