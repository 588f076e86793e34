"""The whole experiment: its sessions in processes side by side, and what comes of them."""

from __future__ import annotations

import io
from collections.abc import Iterable
from dataclasses import asdict
from functools import partial
from pathlib import Path
from typing import Any, Final

import numpy as np

from cdpr_profiles import load_robot
from cdpr_profiles.errors import ProfileError
from cdpr_profiles.reading.bounded_input import read_bytes
from cdpr_rt.arrays import FloatArray
from cdpr_tools.errors import BadInputError, WorkFailedError, os_error_as
from cdpr_tools.experiment import figures
from cdpr_tools.experiment.path import centre_m, targets_m
from cdpr_tools.experiment.points import Points, points_of_perfect_robot, points_of_session
from cdpr_tools.experiment.report import lines
from cdpr_tools.experiment.session import ExperimentSettings, run_session
from cdpr_tools.experiment.statistics import rows, variance_analysis
from cdpr_tools.output import Output, to_json
from cdpr_tools.processes.jobs import processes
from cdpr_tools.recordings.stored_settings import load_settings
from cdpr_tools.report.style import save_figure
from cdpr_tools.trials.directions import platform_of

SETTINGS: Final = "experiment.json"
RESULT: Final = "result.json"
_SESSIONS: Final = "sessions"
_DONE: Final = "done"
_MOST_BYTES: Final = 1 << 28
_SESSION_S: Final = 300.0
"""What one session takes in the robot's time, for the progress shown."""


def begin(settings: ExperimentSettings, folder: Path) -> None:
    """Make the folder of an experiment, or find in it what was begun with the same settings.

    Raises BadInputError where the robot has no room for the pattern, or the folder holds another
    experiment.
    """
    robot = load_robot(settings.robot)
    for place in settings.places:
        centre_m(robot, place)
    path = folder / SETTINGS
    if path.exists():
        if load(folder) != settings:
            raise BadInputError(f"{path}: holds an experiment with other options; choose --out")
        return
    with os_error_as(BadInputError, str(folder)):
        folder.mkdir(parents=True, exist_ok=True)
        if any(folder.iterdir()):
            raise BadInputError(f"{folder}: not empty; allowed: a new folder, or an experiment's")
        path.write_text(to_json(asdict(settings), indent=1), encoding="utf-8")


def load(folder: Path) -> ExperimentSettings:
    """Return what the experiment in `folder` was asked for; raises BadInputError."""
    path = folder / SETTINGS
    return load_settings(path, ExperimentSettings)


def perform(settings: ExperimentSettings, folder: Path, jobs: int, out: Output) -> None:
    """Run the sessions that are still to be run, `jobs` side by side.

    Where some fail the others are run all the same; raises WorkFailedError then.
    """
    missing = [
        name for name in settings.sessions() if not (_session(folder, name) / _DONE).exists()
    ]
    total = len(settings.sessions())
    if not missing:
        return
    out.note(f"{total - len(missing)} of {total} sessions are there; {jobs} side by side ...")
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
    """Run one session; return its name and why it failed, nothing where it did not."""
    session = _session(folder, name)
    if session.exists():  # it was broken off
        session.rename(_unused(session))
    try:
        run_session(settings, settings.sessions()[name], session)
        points_of_session(session)
    except Exception as error:  # whatever it is, the other sessions go on
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


def finished(settings: ExperimentSettings, folder: Path) -> list[Path]:
    """Return the folders of the sessions that have ended, in their order."""
    sessions = (_session(folder, name) for name in settings.sessions())
    return [session for session in sessions if (session / _DONE).exists()]


def measured(sessions: Iterable[Path], jobs: int) -> Points:
    """Return the targets confirmed in sessions, from their recordings; raises CommandError."""
    with processes(jobs) as pool:
        return np.concatenate(pool.map(points_of_session, list(sessions)))


def perfect_robot_points(settings: ExperimentSettings, sessions: Iterable[str]) -> Points:
    """Return what the same operator reaches with a perfect robot in sessions of these names."""
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
    """Return the tables of the same operator with a perfect robot, with `lines` for people."""
    points = perfect_robot_points(settings, settings.sessions())
    table = rows(points)
    result: dict[str, Any] = {
        **asdict(settings),
        "rows": table,
        "variance_analysis": variance_analysis(points),
    }
    return result | {"lines": lines(result)}


def _drawn(
    settings: ExperimentSettings, points: Points, alone: Points, session: Path, folder: Path
) -> list[Path]:
    """Draw all pictures, the path with the way of one of the session's runs."""
    ticks = min(session.glob("*.npy"))
    targets = targets_m(centre_m(load_robot(settings.robot), session.name.split("-")[0]))
    path = folder / "figure-2.8.png"
    save_figure(figures.path(targets, _truth_m(ticks)), path)
    return [path, *figures.draw(points, alone, folder)]


def _truth_m(ticks: Path) -> FloatArray:
    """Return the way of a run that was kept, (k, 2); raises BadInputError."""
    try:
        held = np.load(io.BytesIO(read_bytes(ticks, _MOST_BYTES)), allow_pickle=False)
        return np.asarray(held["truth_m"], float)
    except ProfileError as error:
        raise BadInputError(str(error)) from None
    except (ValueError, LookupError, EOFError, MemoryError, TypeError) as error:
        raise BadInputError(f"{ticks}: not the way of a run: {error}") from None


def judge(folder: Path, jobs: int) -> dict[str, Any]:
    """Compute tables and analysis of the sessions that have ended, and draw them.

    Returns the result, with `lines` for people; it is kept beside the sessions. Raises
    CommandError.
    """
    settings = load(folder)
    sessions = finished(settings, folder)
    if not sessions:
        raise BadInputError(f"{folder}: no session has ended")
    points = measured(sessions, jobs)
    alone = perfect_robot_points(settings, [session.name for session in sessions])
    table = rows(points)
    compared = [row["reached"] for row in table if "reached" in row]
    result: dict[str, Any] = {
        **asdict(settings),
        "sessions": f"{len(sessions)} of {len(settings.sessions())}",
        "rows": table,
        "operator_alone": rows(alone),
        "variance_analysis": variance_analysis(points),
        "reached": bool(compared) and all(compared),
        "pictures": [str(path) for path in _drawn(settings, points, alone, sessions[0], folder)],
    }
    np.save(folder / "points.npy", points)
    (folder / RESULT).write_text(to_json(result, indent=1), encoding="utf-8")
    return result | {"lines": lines(result)}
