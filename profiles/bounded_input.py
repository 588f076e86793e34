"""Read files and messages from outside within bounds on size, depth and digits.

Input that is too long, too deep or not a regular file is rejected before a parser reads it. So no
input causes a hang, an endless recursion or a library's exception.
"""

from __future__ import annotations

import json
import math
import os
import re
import secrets
import stat
import tomllib
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any, BinaryIO, Final, NoReturn, TypeVar

from cdpr_profiles.errors import FileMissingError, ProfileError, brief

MOST_TOML_BYTES: Final = 1 << 18
MOST_JSON_BYTES: Final = 1 << 21
MOST_PARTS: Final = 500_000
"""Limit of strings, arrays, objects and commas in JSON: reporting a wrong one costs 2 kB each."""
MOST_DEPTH: Final = 16
"""Largest nesting of tables and arrays."""
MOST_DIGITS: Final = 99
"""Maximum number of digits of a number; an integer must also fit 64 bits."""

_LEAST_INTEGER, _MOST_INTEGER = -(2**63), 2**64 - 1
# skips strings and comments; possessive quantifiers, so that no text makes the search slow
_JSON_TOKEN: Final = re.compile(
    r'(?P<part>"(?:[^"\\]++|\\.)*+"?|,)|(?P<open>[\[{])|(?P<close>[\]}])'
    rf"|(?P<number>[0-9]{{{MOST_DIGITS + 1},}}+)",
    re.DOTALL,
)
_TOML_TOKEN: Final = re.compile(
    r'"""(?:[^"\\]++|\\.|"(?!""))*+"{0,5}+'
    r"|'''(?:[^']++|'(?!''))*+'{0,5}+"
    r'|"(?:[^"\\\n]++|\\[^\n])*+"?'
    r"|'[^'\n]*+'?"
    r"|#[^\n]*+"
    r"|(?P<open>[\[{])|(?P<close>[\]}])|(?P<dot>\.)|(?P<part>[,=\n])"
    rf"|(?P<number>[0-9]x?[0-9A-Fa-f_]{{{MOST_DIGITS},}}+)",
    re.DOTALL,
)

_T = TypeVar("_T")


def open_regular(path: Path, *, links: bool = True) -> int:
    """Return a descriptor for reading a regular file, or the target of a link if `links`.

    Raises ProfileError, without waiting, for a pipe, a device, a folder or an unreadable file.
    """
    try:
        # O_NONBLOCK: opening a pipe without a writer must not block
        flags = os.O_RDONLY | os.O_NONBLOCK | os.O_NOCTTY | os.O_CLOEXEC
        fd = os.open(path, flags if links else flags | os.O_NOFOLLOW)
    except FileNotFoundError as error:
        raise FileMissingError(path, "", f"cannot be read: {error.strerror}") from None
    except OSError as error:
        raise ProfileError(path, "", f"cannot be read: {error.strerror}") from None
    except ValueError:  # a name with a zero byte
        raise ProfileError(path, "", "cannot be read: not a valid file name") from None
    if not stat.S_ISREG(os.fstat(fd).st_mode):
        os.close(fd)
        raise ProfileError(path, "", "is not a regular file; allowed: a file, or a link to one")
    return fd


def read_bytes(path: Path, most_bytes: int) -> bytes:
    """Return the content of a regular file; raises ProfileError, also if it is too long."""
    with os.fdopen(open_regular(path), "rb") as file:
        try:
            data = file.read(most_bytes + 1)
        except OSError as error:
            raise ProfileError(path, "", f"cannot be read: {error.strerror}") from None
    if len(data) > most_bytes:
        raise ProfileError(path, "", f"is too long; allowed: up to {most_bytes} bytes")
    return data


def read_text(path: Path, most_bytes: int) -> str:
    """Return a regular file's UTF-8 text, with \\n as line ends; raises ProfileError."""
    try:
        text = read_bytes(path, most_bytes).decode("utf-8")
    except UnicodeDecodeError as error:
        raise ProfileError(path, "", f"is not UTF-8 text (byte {error.start})") from None
    return text.replace("\r\n", "\n").replace("\r", "\n")


def read_toml(path: Path) -> dict[str, Any]:
    """Return the tables of a TOML file, with tuples for its arrays; raises ProfileError.

    The error names the line if there is one. A repeated key is rejected, as TOML requires.
    """
    text = read_text(path, MOST_TOML_BYTES)
    _check_toml(path, text)
    try:
        table = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise ProfileError(path, "", f"is not valid TOML: {brief(str(error))}") from None
    return {key: _checked_value(path, key, value, 1) for key, value in table.items()}


def read_json(path: Path, most_bytes: int = MOST_JSON_BYTES) -> Any:
    """Return the content of a JSON file, see `parse_json`; raises ProfileError."""
    return parse_json(read_text(path, most_bytes), path)


def parse_json(text: str | bytes, source: Path | str) -> Any:
    """Return the value of a JSON text; raises ProfileError, which calls the text `source`.

    A repeated key in an object and a number that is not finite are rejected.
    """
    try:
        text = text if isinstance(text, str) else text.decode("utf-8")
    except UnicodeDecodeError as error:
        raise ProfileError(source, "", f"is not UTF-8 text (byte {error.start})") from None
    _check_json(source, text)
    integer = _bounded_number(
        source, int, lambda n: _LEAST_INTEGER <= n <= _MOST_INTEGER, "64 bits"
    )
    number = _bounded_number(source, float, math.isfinite, "a finite number")
    try:
        return json.loads(
            text,
            object_pairs_hook=_unique_keys(source),
            parse_int=integer,
            parse_float=number,
            parse_constant=number,
        )
    except json.JSONDecodeError as error:
        raise ProfileError(source, "", f"is not valid JSON: {error}") from None


def is_mostly_text(data: bytes, most_strings: int, most_other: int) -> bool:
    """Return whether a JSON text has at most these numbers of strings and of bytes outside them.

    Such a text is quick to parse and validate, even if its strings are long.
    """
    plain = data.replace(b"\\\\", b"").replace(b'\\"', b"")  # the remaining quotes delimit strings
    parts = plain.split(b'"', 2 * most_strings + 1)
    return len(parts) <= 2 * most_strings + 1 and sum(map(len, parts[::2])) <= most_other


def may_replace(path: Path, mark: bytes | None = None) -> bool:
    """Return whether writing to `path` destroys only data written by this project.

    True for a file with `mark` in its first 4096 bytes, an empty file, a pipe or device, or if
    there is no file. Without `mark`, for formats that have no room for one, no other file counts as
    the project's.
    """
    try:
        with os.fdopen(open_regular(path), "rb") as file:
            head = file.read(4096)
    except ProfileError:
        return not is_file(path)
    return not head or (mark is not None and mark in head)


@contextmanager
def replacing(path: Path, mode: int = 0o666) -> Iterator[BinaryIO]:
    """Yield a new file, which replaces `path` as a whole if the block ends without an exception.

    The new file is in the folder of `path` and has an unused name, so that no user file is lost;
    `mode` are its permissions, before the umask.
    Raises OSError.
    """
    fresh = path.with_name(f".cdpr-{secrets.token_hex(8)}.part")
    try:
        fd = os.open(fresh, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_CLOEXEC, mode)
        with os.fdopen(fd, "wb") as file:
            yield file
        fresh.replace(path)
    finally:
        with suppress(OSError):  # an earlier error matters more
            fresh.unlink(missing_ok=True)


def is_file(path: Path) -> bool:
    """Return whether there is a regular file of this name, also for an invalid name."""
    try:
        return path.is_file()
    except (OSError, ValueError):
        return False


def is_there(path: Path) -> bool:
    """Return whether anything has this name; raises ProfileError if that is unknown."""
    try:
        entry = path.lstat()
    except (FileNotFoundError, NotADirectoryError):
        link = next((above for above in path.parents if above.is_symlink()), None)
        if link is not None and not link.exists():
            raise _lost_link(path, link) from None
        return False
    except OSError as error:
        if isinstance(error, PermissionError) and not _is_own(path):
            return False  # in another user's home; a user without a home may get here
        raise ProfileError(path, "", f"cannot be searched: {error.strerror}") from None
    except ValueError:  # a name with a zero byte
        return False
    if stat.S_ISLNK(entry.st_mode) and not path.exists():
        raise _lost_link(path, path)
    return True


def _is_own(path: Path) -> bool:
    """Return whether the nearest visible folder above belongs to this user."""
    for above in path.parents:
        with suppress(OSError):
            return above.stat().st_uid == os.geteuid()
    return False


def _lost_link(path: Path, link: Path) -> ProfileError:
    return ProfileError(
        path,
        "",
        f"{link} is a link to {link.readlink()}, which does not exist; mount or restore "
        "it, or remove the link to continue without it",
    )


def path_of(folder: Path, text: str) -> Path:
    """Return the path of `text` from a folder, with `~` expanded."""
    try:
        return folder / Path(text).expanduser()
    except RuntimeError:  # no user has this home
        return folder / text


def resolved(path: Path) -> Path:
    """Return an absolute path without links, as far as it can be resolved."""
    try:
        return path.resolve()
    except (OSError, ValueError, RuntimeError):  # a zero byte, or circular links
        return path.absolute()


def _check_json(source: Path | str, text: str) -> None:
    depth = parts = 0
    for token in _JSON_TOKEN.finditer(text):
        kind = token.lastgroup
        parts += kind in ("open", "part")
        if parts > MOST_PARTS:
            raise ProfileError(source, "", f"too many keys and values; allowed: {MOST_PARTS}")
        if kind == "open":
            depth += 1
            if depth > MOST_DEPTH:
                _refuse_depth(source, text, token.start())
        elif kind == "close":
            depth -= 1
        elif kind == "number":
            _refuse_digits(source, text, token)


def _check_toml(path: Path, text: str) -> None:
    depth = dots = 0
    for token in _TOML_TOKEN.finditer(text):
        kind = token.lastgroup
        if kind == "number":
            _refuse_digits(path, text, token)
        elif kind == "dot":
            dots += 1
        elif kind is not None:
            dots = 0
            depth += (kind == "open") - (kind == "close")
        if depth > MOST_DEPTH or dots > MOST_DEPTH:
            _refuse_depth(path, text, token.start())


def _checked_value(path: Path, key: str, value: Any, depth: int) -> Any:
    """Return a TOML value with tuples for arrays; raises ProfileError if it is too deep or big."""
    if isinstance(value, list | dict) and depth > MOST_DEPTH:
        raise ProfileError(path, brief(key), f"is nested too deeply; allowed: {MOST_DEPTH} levels")
    if isinstance(value, list):
        return tuple(_checked_value(path, key, v, depth + 1) for v in value)
    if isinstance(value, dict):
        return {k: _checked_value(path, key, v, depth + 1) for k, v in value.items()}
    if isinstance(value, int) and not _LEAST_INTEGER <= value <= _MOST_INTEGER:
        # not in the message: Python refuses to format a number with thousands of digits
        bits = value.bit_length()
        raise ProfileError(
            path, brief(key), f"a whole number of {bits} bits; allowed: -2^63 to 2^64 - 1"
        )
    return value


def _unique_keys(source: Path | str) -> Callable[[list[tuple[str, Any]]], dict[str, Any]]:
    def take(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
        table = dict(pairs)
        if len(table) < len(pairs):
            counts = Counter(name for name, _ in pairs)
            twice = next(name for name, count in counts.items() if count > 1)
            raise ProfileError(source, brief(twice), "is given twice; allowed: each key once")
        return table

    return take


def _bounded_number(
    source: Path | str, kind: Callable[[str], _T], fits: Callable[[_T], bool], allowed: str
) -> Callable[[str], _T]:
    def take(text: str) -> _T:
        value = kind(text)
        if not fits(value):
            raise ProfileError(source, "", f"value {text}; allowed: {allowed}")
        return value

    return take


def _refuse_depth(source: Path | str, text: str, at: int) -> NoReturn:
    where = f"line {text.count(chr(10), 0, at) + 1}"
    raise ProfileError(source, where, f"is nested too deeply; allowed: {MOST_DEPTH} levels")


def _refuse_digits(source: Path | str, text: str, token: re.Match[str]) -> NoReturn:
    where = f"line {text.count(chr(10), 0, token.start()) + 1}"
    count = token.end() - token.start()
    raise ProfileError(source, where, f"a number of {count} digits; allowed: {MOST_DIGITS}")
