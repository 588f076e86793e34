"""Load the user's own code from a file, a module, or an installed package."""

from __future__ import annotations

import hashlib
import sys
from importlib import import_module
from importlib.metadata import entry_points
from pathlib import Path
from types import ModuleType
from typing import Any, Final

from cdpr_profiles.bounded_input import path_of, read_bytes, resolved
from cdpr_profiles.errors import ProfileError
from cdpr_rt.errors import ControlError, error_text
from cdpr_rt.state_file import read_state, state_path, write_state

_MOST_BYTES: Final = 1 << 22


class CodeError(ControlError):
    """Code cannot be loaded or is not allowed to run; the message begins with its reference."""


def load_code(reference: str) -> Any:
    """Load the object at "FILE.py:NAME" or "MODULE:NAME"; if it is a class, return an instance.

    Loading runs the code of the file or module. A file can import modules from its folder unless an
    installed module has the same name. Raises CodeError.
    """
    home, _, name = reference.rpartition(":")
    try:
        if home.endswith(".py"):
            source, folder = _read(reference, Path(home)), str(Path(home).resolve().parent)
            if folder not in sys.path:
                sys.path.append(folder)
            return _member(_run(Path(home), source), name)
        return _member(import_module(home), name)
    except CodeError:
        raise
    except (Exception, SystemExit) as error:  # the user's code may raise anything
        raise CodeError(
            f"{reference}: {error_text(error)}; give FILE.py:NAME or MODULE:NAME"
        ) from error


def require_file(reference: str) -> None:
    """Raise CodeError if "FILE.py:NAME" names a file that cannot be read. This runs no code."""
    home = reference.rpartition(":")[0]
    if home.endswith(".py"):
        _read(reference, Path(home))


def load_registered(group: str) -> dict[str, Any]:
    """Load all objects that installed packages register in a group of entry points.

    Returns them by name; classes are instantiated as in `load_code`. Raises CodeError that names
    the package.
    """
    return {point.name: _loaded(point) for point in entry_points(group=group)}


def load_registered_one(group: str, name: str) -> Any:
    """Load the object that an installed package registers under a name, as `load_code` does.

    Raises CodeError.
    """
    for point in entry_points(group=group, name=name):
        return _loaded(point)
    raise CodeError(f"{name}: no installed package registers this name in {group!r}")


def _loaded(point: Any) -> Any:
    try:
        found = point.load()
        return found() if isinstance(found, type) else found
    except (Exception, SystemExit) as error:
        package = "" if point.dist is None else f" of the package {point.dist.name}"
        raise CodeError(
            f"{point.name}{package}: {error_text(error)}; repair or uninstall it"
        ) from error


# Code that a robot's file names runs only if the user has allowed this content of this file.


def require_allowed(reference: str, folder: Path, *, allow: bool) -> None:
    """Raise CodeError unless the user has allowed the code of "FILE.py:NAME".

    FILE is relative to `folder`. `allow` permits the code from now on, as long as the file does not
    change.
    """
    _allowed_source(reference, folder, allow=allow)


def load_allowed(reference: str, folder: Path) -> Any:
    """Load the object at "FILE.py:NAME" as `load_code` does, from the allowed bytes only.

    Raises CodeError if the user has not allowed the file's content, see `require_allowed`.
    """
    file, source = _allowed_source(reference, folder, allow=False)
    try:
        return _member(_run(file, source), reference.rpartition(":")[2])
    except (Exception, SystemExit) as error:
        raise CodeError(f"{reference}: {error_text(error)}") from error


def _allowed_source(reference: str, folder: Path, *, allow: bool) -> tuple[Path, bytes]:
    file = resolved(path_of(folder, reference.rpartition(":")[0]))
    source = _read(reference, file)
    digest = hashlib.sha256(source).hexdigest()
    path = state_path("allowed-code", hashlib.sha256(str(file).encode()).hexdigest()[:32])
    if allow:
        write_state(path, {"file": str(file), "sha256": digest})
        return file, source
    known = read_state(path) or {}
    if known.get("file") != str(file) or known.get("sha256") != digest:
        changed = " and has changed since you allowed it" if known else ""
        raise CodeError(
            f"{reference}: {file} is code that would run with your rights{changed}; "
            "read it, then allow it with --allow-code, in Python with allow_code=True"
        )
    return file, source


def _read(reference: str, file: Path) -> bytes:
    try:
        return read_bytes(file, _MOST_BYTES)
    except ProfileError as error:
        raise CodeError(f"{reference}: {error}") from None


def _run(file: Path, source: bytes) -> ModuleType:
    """Run a file's bytes as a new module, without using the cache of compiled code."""
    module = ModuleType(f"own_code_{file.stem}")
    module.__file__ = str(file)
    sys.modules[module.__name__] = module  # where dataclasses and pickle look for it
    exec(compile(source, str(file), "exec"), module.__dict__)
    return module


def _member(module: ModuleType, name: str) -> Any:
    found = getattr(module, name)
    return found() if isinstance(found, type) else found
