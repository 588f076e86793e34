"""Profile errors with file, key and value, and the formatting of values in them."""

import re
from pathlib import Path

_MOST_CHARS = 200
_MOST_LINE_CHARS = 1000


# C0 except tab and line feed, DEL, C1, bidirectional marks, lone surrogates
_ACTING = re.compile(
    "[\x00-\x08\x0b-\x1f\x7f-\x9f\u061c\u200e\u200f\u2028-\u202e\u2066-\u2069\ud800-\udfff]"
)


def printable(text: str) -> str:
    """Return a text that is safe for a terminal: control characters are shown as escapes.

    Names and texts come from files, drives and other users.
    """
    return _ACTING.sub(lambda found: repr(found[0])[1:-1], text)


def brief(text: str, most: int = _MOST_CHARS) -> str:
    """Return a text for use in a message: printable and cut to `most` characters."""
    printable = text if text.isprintable() else repr(text)[1:-1]
    return printable if len(printable) <= most else printable[: most - 3] + "..."


def value_text(value: object) -> str:
    """Return a value for use in a message, arrays in brackets, cut to 60 characters."""
    return brief(repr(_as_lists(value)), 60)


def _as_lists(value: object) -> object:
    return [_as_lists(entry) for entry in value] if isinstance(value, list | tuple) else value


class ProfileError(Exception):
    """A profile cannot be used; the text has the file, the key, the value and what is allowed.

    `file` and `key` (dotted, "" for the file as a whole) are available to programs.
    """

    def __init__(self, file: Path | str, key: str, problem: str) -> None:
        self.file = str(file)
        self.key = key
        self.problem = "\n".join(brief(line, _MOST_LINE_CHARS) for line in problem.split("\n"))
        where = f"{self.file}: {key}" if key else self.file
        super().__init__(f"{where}: {self.problem}")


class FileMissingError(ProfileError):
    """The file does not exist."""
