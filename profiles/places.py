"""Search profiles beside the file that names them, in the user's folder, among the shipped ones."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Literal, get_args

from cdpr_profiles.bounded_input import is_file, is_there, path_of, read_toml
from cdpr_profiles.errors import ProfileError
from cdpr_profiles.reader import closest

ProfileKind = Literal[
    "motors", "drives", "cables", "winches", "robots", "tension_sensors", "safety_io", "rails"
]
KINDS: tuple[ProfileKind, ...] = get_args(ProfileKind)
SHIPPED = Path(__file__).resolve().parents[0]
_DISTINCTIVE_KEYS: dict[ProfileKind, str] = {
    "motors": "torque_constant_Nm_per_Arms",
    "drives": "eds",
    "cables": "breaking_force_kgf",
    "winches": "drum_radius_m",
    "robots": "axes",
    "tension_sensors": "baudrate",
}
"""A key that all files of a kind have, and files of no other kind."""
SERIES = ".series.toml"
"""End of the file name of a series of motors or cables; a series itself is not a profile."""


def user_folder() -> Path:
    """Return the folder of the user's own profiles, with a folder for each kind.

    It is $XDG_CONFIG_HOME/cdpr-rt/profiles, by default ~/.config/cdpr-rt/profiles.
    """
    base = os.environ.get("XDG_CONFIG_HOME", "")
    folder = Path(base) if base.startswith("/") else path_of(Path(), "~/.config")
    return folder / "cdpr-rt" / "profiles"


def profile_files(kind: ProfileKind) -> Iterator[Path]:
    """Yield the files of a kind, the user's own first."""
    for folder in (user_folder() / kind, SHIPPED / kind):
        yield from sorted(p for p in _toml_files(folder) if not p.name.endswith(SERIES))


def _toml_files(folder: Path) -> list[Path]:
    """Return the TOML files of a folder; none if this user may not read the folder."""
    try:
        return list(folder.glob("*.toml"))
    except OSError:
        return []


def find(kind: ProfileKind, name: str | Path, beside: Path | None = None) -> Path | None:
    """Return the file of a profile given by name or path; None if there is no such file.

    `beside` is a folder that is searched first and from which relative paths start.
    """
    text = str(name)
    if isinstance(name, Path) or "/" in text or text.endswith(".toml"):
        return path_of(beside if beside is not None else Path(), text)
    folders = [user_folder() / kind, SHIPPED / kind]
    if beside is not None:
        folders.insert(0, beside)
    return next((p for folder in folders if is_there(p := folder / f"{text}.toml")), None)


def require(kind: ProfileKind, name: str | Path, beside: Path | None = None) -> Path:
    """Return the file of a profile as `find` does; raises ProfileError if it does not exist."""
    path = find(kind, name, beside)
    if path is None:
        raise unknown_profile(kind, name, beside)
    return path


def unknown_profile(
    kind: ProfileKind, name: str | Path, beside: Path | None = None, more: Iterable[str] = ()
) -> ProfileError:
    """Return the error for a name without a profile; `more` has further allowed names."""
    known = {path.stem for path in profile_files(kind)} | set(more)
    text, folder = str(name), beside if beside is not None else Path()
    if beside is not None:
        known |= {path.stem for path in _toml_files(beside) if _is_of(kind, path)}
    one = kind.removesuffix("es" if kind == "winches" else "s").replace("_", " ")
    if is_file(path_of(folder, text)):
        problem = f"{text!r} is not a {one} file (TOML, with a name that ends in .toml)"
        return ProfileError(kind, "", f"{problem}; allowed: {', '.join(sorted(known))}")
    problem = f"no profile named {text!r}"
    if (ending := Path(text).suffix) and not ending[1:].isdigit():
        problem = f"no such file: {text!r}"
        known |= {path.name for path in _toml_files(folder) if _is_of(kind, path)}
    suggestion = closest(text, known)
    hint = f"did you mean {suggestion!r}?" if suggestion else f"allowed: {', '.join(sorted(known))}"
    return ProfileError(kind, "", f"{problem}; {hint} (or a path to a file)")


def _is_of(kind: ProfileKind, path: Path) -> bool:
    """Return whether a TOML file is of this kind, judged by its keys."""
    try:
        return kind not in _DISTINCTIVE_KEYS or _DISTINCTIVE_KEYS[kind] in read_toml(path)
    except ProfileError:
        return False


def reference(kind: ProfileKind, path: Path) -> str:
    """Return a reference that is valid in any folder and for any user: a shipped name, or a path.

    A user's own profile hides a shipped one with the same name, which then needs its path.
    """
    shipped = path.parent == SHIPPED / kind and find(kind, path.stem) == path
    return path.stem if shipped else str(path)
