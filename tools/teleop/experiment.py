"""The whole experiment: its sessions in parallel processes, and its result."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import asdict
from functools import partial
from pathlib import Path
from typing import Any, Final

import numpy as np

from cdpr_profiles import load_robot
from cdpr_tools.errors import BadInputError, WorkFailedError, os_error_as
from cdpr_tools.output import Output, to_json
from cdpr_tools.processes import processes
from cdpr_tools.recordings.stored_settings import load_settings
from cdpr_tools.teleop.experiment_tables import draw, lines, rows, variance_analysis
from cdpr_tools.teleop.experiment_trial import (
    ExperimentSettings,
    Points,
    centre_m,
    points_of_perfect_robot,
    points_of_session,
    run_session,
)
from cdpr_tools.trials.directions import platform_of

SETTINGS: Final = "experiment.json"
RESULT: Final = "result.json"
_SESSIONS: Final = "sessions"
_DONE: Final = "done"
_SESSION_S: Final = 300.0
"""Approximate robot time of one session, for the progress display."""


def begin(settings: ExperimentSettings, folder: Path) -> None:
    """Make the folder of an experiment, or accept one that was begun with the same settings.

    Raises BadInputError if the robot has no room for the pattern, or the folder holds another
    experiment.
    """
    robot = load_robot(settings.robot)
    for place in settings.places:
        centre_m(robot, place)
    path = folder / SETTINGS
    if path.exists():
        if load(folder) != settings:
            raise BadInputError(
                f"{path}: contains an experiment with other options; choose another --out"
            )
        return
    with os_error_as(BadInputError, str(folder)):
        folder.mkdir(parents=True, exist_ok=True)
        if any(folder.iterdir()):
            raise BadInputError(
                f"{folder}: is not empty, and holds no experiment; choose a new folder"
            )
        path.write_text(to_json(asdict(settings), indent=1), encoding="utf-8")


def load(folder: Path) -> ExperimentSettings:
    """Return the settings of the experiment in `folder`; raises BadInputError."""
    return load_settings(folder / SETTINGS, ExperimentSettings)


def perform(settings: ExperimentSettings, folder: Path, jobs: int, out: Output) -> None:
    """Run the sessions that are still missing, `jobs` in parallel.

    If one fails, the others still run; then raises WorkFailedError.
    """
    missing = [
        name for name in settings.sessions() if not (_session(folder, name) / _DONE).exists()
    ]
    total = len(settings.sessions())
    if not missing:
        return
    out.note(f"{total - len(missing)} of {total} sessions exist; running {jobs} in parallel ...")
    done, failed = total - len(missing), []
    work = partial(_perform_session, settings, folder)
    with processes(jobs) as pool, out.progress("sessions", total * _SESSION_S) as advance:
        for name, error in pool.imap_unordered(work, missing):
            if error:
                failed.append(f"{name}: {error}")
            done += not error
            advance(done * _SESSION_S)
            out.note(f"{name}: {error or 'done'}")
    if failed:
        raise WorkFailedError(f"{len(failed)} of {total} sessions failed; {failed[0]}")


def _perform_session(settings: ExperimentSettings, folder: Path, name: str) -> tuple[str, str]:
    """Run one session; return its name and why it failed, "" if it did not."""
    session = _session(folder, name)
    if session.exists():  # an earlier run was interrupted
        session.rename(_unused(session))
    try:
        run_session(settings, settings.sessions()[name], session)
        points_of_session(session)
    except Exception as error:  # the other sessions continue after any error
        return name, str(error) or repr(error)
    (session / _DONE).touch()
    return name, ""


def _unused(session: Path) -> Path:
    count = 1
    while (broken := session.with_name(f"{session.name}.broken-{count}")).exists():
        count += 1
    return broken


def _session(folder: Path, name: str) -> Path:
    return folder / _SESSIONS / name


def perfect_robot_points(settings: ExperimentSettings, sessions: Iterable[str]) -> Points:
    """Return the points of the same operator with a perfect robot in sessions of these names."""
    robot = load_robot(settings.robot)
    platform = platform_of(robot)
    return np.concatenate(
        [
            points_of_perfect_robot(
                platform,
                centre_m(robot, condition.place),
                condition,
                settings.operator,
                settings.station,
                settings.seed,
            )
            for name in sessions
            for condition in settings.sessions()[name]
        ]
    )


def operator_alone(settings: ExperimentSettings) -> dict[str, Any]:
    """Return the tables of the same operator with a perfect robot, with `lines` of text."""
    result = _result(settings, perfect_robot_points(settings, settings.sessions()))
    return result | {"lines": lines(result)}


def _result(settings: ExperimentSettings, points: Points) -> dict[str, Any]:
    analysis = {"rows": rows(points), "variance_analysis": variance_analysis(points)}
    return asdict(settings) | analysis


def judge(folder: Path, jobs: int) -> dict[str, Any]:
    """Compute tables and analysis of the finished sessions, and draw them.

    Returns the result, with `lines` of text; it is stored beside the sessions. Raises
    CommandError.
    """
    settings = load(folder)
    names = (_session(folder, name) for name in settings.sessions())
    sessions = [session for session in names if (session / _DONE).exists()]
    if not sessions:
        raise BadInputError(f"{folder}: no session has ended")
    with processes(jobs) as pool:
        points = np.concatenate(pool.map(points_of_session, sessions))
    alone = perfect_robot_points(settings, [session.name for session in sessions])
    result = _result(settings, points)
    compared = [row["reached"] for row in result["rows"] if "reached" in row]
    result |= {
        "sessions": f"{len(sessions)} of {len(settings.sessions())}",
        "operator_alone": rows(alone),
        "reached": bool(compared) and all(compared),
        "pictures": [str(path) for path in draw(points, folder)],
    }
    np.save(folder / "points.npy", points)
    (folder / RESULT).write_text(to_json(result, indent=1), encoding="utf-8")
    return result | {"lines": lines(result)}
