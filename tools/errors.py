"""How a command ends when it cannot do its work, and what the shell is told."""

DONE, FAILED, BAD_INPUT = 0, 1, 2


class CommandError(Exception):
    """A command ends early; `exit_status` goes to the shell, the message to the user."""

    exit_status = FAILED


class WorkFailedError(CommandError):
    """The work was begun and failed: a drive fault, a limit, a lost bus."""


class BadInputError(CommandError):
    """The command cannot begin: a wrong argument, file, profile or bus."""

    exit_status = BAD_INPUT
