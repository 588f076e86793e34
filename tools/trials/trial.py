"""Trials by name: run a trial on its own simulator, and judge its recording."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, field
from itertools import chain
from pathlib import Path
from typing import Any, Final

from matplotlib.figure import Figure as Picture

from cdpr_drivers.robot.commissioned import uncommissioned_text, with_commissioned
from cdpr_profiles import Robot, load_robot
from cdpr_profiles.calibration_in_force import calibrated
from cdpr_rt.diagnosis.checks import refuse_impossible
from cdpr_tools.composition.own_code import OwnCodeOptions
from cdpr_tools.errors import BadInputError
from cdpr_tools.output import Output, to_json
from cdpr_tools.recordings.stored_settings import load_settings
from cdpr_tools.robots.calibration_text import calibration_text
from cdpr_tools.style import save_figure
from cdpr_tools.trials import limits, line, path, pictures, streaming, tape, targets
from cdpr_tools.trials.directions import platform_of
from cdpr_tools.trials.figures import Figure, all_reached, figures_table
from cdpr_tools.trials.recorded import Recorded
from cdpr_tools.trials.run import TrialRun, trial_run

SETTINGS, PICTURE, FIGURES, PLANT = "trial.json", "trial.png", "figures.json", "plant.toml"
_ONE: Final = "run"

Parts = dict[str, Recorded]


@dataclass(frozen=True)
class TrialSettings:
    """Settings of a trial; stored beside its recordings."""

    kind: str
    robot: str
    plant: str | None
    seed: int
    minutes: float
    commissioned: str | None
    compensated: bool
    speed_m_s: float = line.SPEED_m_s
    """Speed of lines and paths."""
    own: OwnCodeOptions = field(default_factory=OwnCodeOptions)
    """The user's own code that the trial runs."""

    @classmethod
    def load(cls, folder: Path) -> TrialSettings:
        """Return the settings of the trial in `folder`; raises BadInputError."""
        return load_settings(folder / SETTINGS, cls)

    @property
    def parts(self) -> Sequence[str]:
        """Folders of the recordings, one for each start of the robot."""
        if not KINDS[self.kind].compares:
            return (_ONE,)
        return (line.WITH, line.WITHOUT) if self.compensated else (line.WITHOUT,)


@dataclass(frozen=True)
class TrialKind:
    """One kind of trial: how the robot is driven, judged and drawn."""

    drive: Callable[[TrialRun, TrialSettings], None]
    judge: Callable[[Parts, Robot, TrialSettings], list[Figure]]
    draw: Callable[[Parts, Robot, TrialSettings], Picture]
    minutes: float
    """Default duration, in bus time."""
    compares: bool = False
    """Whether the trial runs with and without compensation."""
    at_speed: bool = False
    """Whether the trial has a speed setting, which determines its duration."""
    as_calibrated: bool = True
    """Whether the trial uses the calibration in force."""


KINDS: Final = {
    "targets": TrialKind(
        lambda run, settings: targets.drive(run, 60.0 * settings.minutes),
        lambda parts, _robot, _settings: targets.judge(parts[_ONE]),
        lambda parts, _robot, _settings: pictures.of_targets(parts[_ONE]),
        2.0,
    ),
    "line": TrialKind(
        lambda run, settings: line.drive(run, settings.speed_m_s),
        lambda parts, _robot, settings: line.judge(parts, settings.speed_m_s),
        lambda parts, _robot, settings: pictures.of_lines(parts, settings.speed_m_s),
        0.0,
        compares=True,
        at_speed=True,
    ),
    "random": TrialKind(
        lambda run, settings: limits.drive(run, 60.0 * settings.minutes),
        lambda parts, robot, _settings: limits.judge(parts[_ONE], robot),
        lambda parts, robot, _settings: pictures.of_limits(parts[_ONE], robot),
        10.0,
    ),
    "stream": TrialKind(
        lambda run, settings: streaming.drive(run, 60.0 * settings.minutes),
        lambda parts, _robot, _settings: streaming.judge(parts[_ONE]),
        lambda parts, _robot, _settings: pictures.of_stream(parts[_ONE]),
        1.0,
    ),
    "path": TrialKind(
        lambda run, settings: path.drive(run, settings.speed_m_s),
        lambda parts, robot, settings: path.judge(parts[_ONE], robot, settings.speed_m_s),
        lambda parts, robot, settings: pictures.of_path(parts[_ONE], robot, settings.speed_m_s),
        1.0,
        at_speed=True,
    ),
    "tape": TrialKind(
        lambda run, settings: tape.drive(run, 60.0 * settings.minutes),
        lambda parts, robot, _settings: tape.judge(parts[_ONE], robot),
        lambda parts, robot, _settings: pictures.of_tape(parts[_ONE], robot),
        30.0,
        as_calibrated=False,
    ),
}


def perform(settings: TrialSettings, folder: Path, out: Output) -> dict[str, Any]:
    """Run a trial, record it in `folder` and judge it; return the result of `judge`."""
    kind = KINDS[settings.kind]
    robot = load_robot(settings.robot)
    platform = platform_of(robot)
    refuse_impossible(robot)
    if kind.at_speed and settings.speed_m_s > platform.speed_m_s:
        raise BadInputError(
            f"--speed-mm-s {1e3 * settings.speed_m_s:g}: allowed: up to "
            f"{1e3 * platform.speed_m_s:g}, speed_m_s of the robot's file"
        )
    knows = settings.commissioned is not None or any(axis.commissioned for axis in robot.axes)
    if kind.compares and settings.compensated and not knows:
        raise BadInputError(
            f"{settings.kind}: compares motion with and without compensation, but the "
            "motors are not commissioned; give --commissioned DIR with the results of "
            f"`cdpr commission {settings.robot} --all`, or --without-compensation"
        )
    text = uncommissioned_text(with_commissioned(robot, _path(settings.commissioned)))
    if settings.compensated and text:
        out.note(text)
    if kind.as_calibrated and (known := calibrated(robot).calibration) is not None:
        out.note(calibration_text(known.summary()))
    plant, own = _plant(settings, robot, folder), settings.own.load()
    for notice in settings.own.notices(robot):
        out.note(notice)
    for part in settings.parts:
        compensated = settings.compensated and part != line.WITHOUT
        out.note(f"{settings.robot}, {settings.kind}: starting the simulated robot ...")
        with (
            out.progress(f"{settings.kind}, {part}", 60.0 * settings.minutes) as advance,
            trial_run(
                settings.robot,
                folder / part,
                plant=plant,
                seed=settings.seed,
                advance=advance,
                commissioned=_path(settings.commissioned),
                compensated=compensated,
                learns=compensated or len(settings.parts) == 1,
                as_calibrated=kind.as_calibrated,
                own=own,
            ) as run,
        ):
            kind.drive(run, settings)
    (folder / SETTINGS).write_text(to_json(asdict(settings), indent=1), encoding="utf-8")
    return judge(folder)


def judge(folder: Path) -> dict[str, Any]:
    """Compute a trial's figures from its recordings and the truth; draw its picture."""
    settings = TrialSettings.load(folder)
    kind, robot = KINDS[settings.kind], load_robot(settings.robot)
    parts = {part: Recorded(folder / part) for part in settings.parts}
    figures = kind.judge(parts, robot, settings)
    ends = {part: one.marked("end")[0] for part, one in parts.items()}
    begins = [one.marked("begin")[0] for one in parts.values()]
    calibration = begins[0].get("calibration")  # the same in all parts
    notices = {part: end.get("notices", []) for part, end in ends.items()}
    save_figure(kind.draw(parts, robot, settings), folder / PICTURE)
    result = {
        **asdict(settings),
        "speed_m_s": settings.speed_m_s if kind.at_speed else None,
        "figures": {figure.key: figure.as_table() for figure in figures},
        "reached": all_reached(figures),
        "calibration": calibration,
        "refused": {part: end["refused"] for part, end in ends.items()},
        "notices": notices,
        "recordings": [str(path) for path in sorted(folder.glob("*/*.mcap"))],
        "truth": [str(path) for path in sorted(folder.glob("*/truth.log"))],
        "picture": str(folder / PICTURE),
        "lines": [
            *([] if calibration is None else [calibration_text(calibration)]),
            figures_table(figures),
            *(f"note: {text}" for text in dict.fromkeys(chain(*notices.values()))),
        ],
    }
    kept = {key: value for key, value in result.items() if key != "lines"}
    (folder / FIGURES).write_text(to_json(kept, indent=1), encoding="utf-8")
    return result


def _plant(settings: TrialSettings, robot: Robot, folder: Path) -> Path | None:
    """Return the plant file of a trial; `tape` writes its own into the trial's folder."""
    given = _path(settings.plant)
    if settings.kind != "tape":
        return given
    text = tape.plant_text(robot, given, settings.seed)
    path = folder / PLANT
    try:
        folder.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")
    except OSError as error:
        raise BadInputError(f"{path}: cannot be written: {error.strerror}") from error
    return path


def _path(text: str | None) -> Path | None:
    return None if text is None else Path(text)
