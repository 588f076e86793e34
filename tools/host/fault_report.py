"""A fault report as one text: versions, host, robots, the last recording."""

from __future__ import annotations

import platform
import sys
from collections.abc import Iterator, Sequence
from datetime import UTC, datetime
from importlib.metadata import distributions

from cdpr_profiles import load_robot
from cdpr_profiles.bounded_input import MOST_TOML_BYTES, is_file, read_text
from cdpr_profiles.calibration_in_force import calibration_file
from cdpr_tools.daemon.paths import default_recordings, find_loop_files
from cdpr_tools.errors import BadInputError
from cdpr_tools.output import Output
from cdpr_tools.recordings.summary import summarise, summary_lines

_EVENTS = 40
_PACKAGES = (
    "cdpr-rt", "numpy", "scipy", "numba", "canopen", "python-can", "pydantic", "typer", "fastapi",
    "uvicorn", "foxglove-sdk", "pyarrow", "osqp",
)  # fmt: skip


def fault_report(findings: Sequence[str], robots: Sequence[str]) -> str:
    """Return the report; `findings` are about the host, `robots` are names or paths of files.

    No part of it contains keys. Raises ProfileError for a robot that cannot be read.
    """
    now = datetime.now(UTC).isoformat(timespec="seconds")
    daemons = [path.stem for path in find_loop_files()] or ["none found"]
    parts = [
        ("cdpr doctor --report", [now]),
        ("versions", list(_versions())),
        ("this machine", [platform.platform(), *findings]),
        ("daemons", daemons),
        *((f"robot {name}", _robot(name)) for name in robots),
        ("the last recording", _last_recording()),
    ]
    return "\n".join(f"== {title}\n" + "\n".join(lines) + "\n" for title, lines in parts)


def _versions() -> Iterator[str]:
    yield f"Python {sys.version.split()[0]}"
    there = {one.metadata["Name"].lower(): one.version for one in distributions()}
    for name in _PACKAGES:
        yield f"{name} {there.get(name, 'not there')}"


def _robot(name: str) -> list[str]:
    robot = load_robot(name)
    known = calibration_file(robot)
    files = [robot.path, *([known] if is_file(known) else [])]
    return [
        line
        for path in files
        for line in (str(path), *read_text(path, MOST_TOML_BYTES).splitlines())
    ]


def _last_recording() -> list[str]:
    """Return the figures and the last events of the newest recording."""
    folder = default_recordings()
    found = sorted(folder.glob("*.mcap"), key=lambda path: path.stat().st_mtime)
    if not found:
        return [f"none in {folder}"]
    try:
        return list(summary_lines(summarise(found[-1], Output(as_json=True)), _EVENTS))
    except BadInputError as error:
        return [str(error)]
