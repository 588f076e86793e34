"""Trials by name: run one on a simulator of its own, and judge what it has recorded."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Final

from matplotlib.figure import Figure as Picture

from profiles import Robot, load_robot
from tools.errors import BadInputError
from tools.kept import kept
from tools.output import Output, to_json
from tools.robots.checks import refuse_impossible
from tools.trials import limits, line, pictures, streaming, targets
from tools.trials.figures import Figure, all_reached
from tools.trials.recorded import Recorded
from tools.trials.run import TrialRun, platform_of, trial_run

ASKED, PICTURE, FIGURES = "trial.json", "trial.png", "figures.json"
_ONE: Final = "run"

Parts = dict[str, Recorded]


@dataclass(frozen=True)
class Kind:
    """One kind of trial: how the robot is driven, judged and drawn."""

    drive: Callable[[TrialRun, float], None]
    judge: Callable[[Parts, Robot], list[Figure]]
    draw: Callable[[Parts, Robot], Picture]
    minutes: float
    """How long it lasts, in bus time, where nothing else is wanted."""
    fixed: bool = False
    """Whether it lasts as long as it lasts, with compensation and without."""


KINDS: Final = {
    "targets": Kind(
        targets.drive,
        lambda parts, _robot: targets.judge(parts[_ONE]),
        lambda parts, robot: pictures.of_targets(parts[_ONE], robot),
        2.0,
    ),
    "line": Kind(
        line.drive,
        lambda parts, _robot: line.judge(parts),
        lambda parts, _robot: pictures.of_lines(parts),
        0.0,
        fixed=True,
    ),
    "random": Kind(
        limits.drive,
        lambda parts, robot: limits.judge(parts[_ONE], robot),
        lambda parts, robot: pictures.of_limits(parts[_ONE], robot),
        10.0,
    ),
    "stream": Kind(
        streaming.drive,
        lambda parts, robot: streaming.judge(parts[_ONE], robot),
        lambda parts, robot: pictures.of_stream(parts[_ONE], robot),
        1.0,
    ),
}


@dataclass(frozen=True)
class Asked:
    """What a trial was asked for; kept beside its recordings."""

    kind: str
    robot: str
    plant: str | None
    seed: int
    minutes: float
    commissioned: str | None
    compensated: bool

    @classmethod
    def load(cls, folder: Path) -> Asked:
        """Return what the trial in `folder` was asked for; raises BadInputError."""
        return kept(folder / ASKED, cls)

    @property
    def parts(self) -> Sequence[str]:
        """Folders of the recordings, one for each time that the robot was started."""
        if not KINDS[self.kind].fixed:
            return (_ONE,)
        return (line.WITH, line.WITHOUT) if self.compensated else (line.WITHOUT,)


def perform(asked: Asked, folder: Path, out: Output) -> dict[str, Any]:
    """Run a trial, recorded in `folder`, and judge it; return what `judge` does."""
    kind = KINDS[asked.kind]
    robot = load_robot(asked.robot)
    platform_of(robot)
    refuse_impossible(robot)
    knows = asked.commissioned is not None or any(axis.commissioned for axis in robot.axes)
    if kind.fixed and asked.compensated and not knows:
        raise BadInputError(
            f"{asked.kind}: compares motion with compensation and without, and nothing is known of "
            f"the motors; allowed: --commissioned DIR, what `cdpr commission {asked.robot} --all` "
            "has left, or --without-compensation"
        )
    for part in asked.parts:
        compensated = asked.compensated and part != line.WITHOUT
        out.note(f"{asked.robot}, {asked.kind}: starting the simulated robot ...")
        with (
            out.progress(f"{asked.kind}, {part}", 60.0 * asked.minutes) as advance,
            trial_run(
                asked.robot,
                folder / part,
                plant=_path(asked.plant),
                seed=asked.seed,
                advance=advance,
                commissioned=_path(asked.commissioned),
                compensated=compensated,
            ) as run,
        ):
            kind.drive(run, 60.0 * asked.minutes)
    (folder / ASKED).write_text(to_json(asdict(asked), indent=1), encoding="utf-8")
    return judge(folder)


def judge(folder: Path) -> dict[str, Any]:
    """Compute a trial's figures from its recordings and from what was true; draw its picture."""
    asked = Asked.load(folder)
    kind, robot = KINDS[asked.kind], load_robot(asked.robot)
    parts = {part: Recorded(folder / part) for part in asked.parts}
    figures = kind.judge(parts, robot)
    kind.draw(parts, robot).savefig(folder / PICTURE)
    result = {
        **asdict(asked),
        "figures": {figure.key: figure.told() for figure in figures},
        "reached": all_reached(figures),
        "refused": {part: one.marked("end")[0]["refused"] for part, one in parts.items()},
        "recordings": [str(path) for path in sorted(folder.glob("*/*.mcap"))],
        "truth": [str(path) for path in sorted(folder.glob("*/truth.log"))],
        "picture": str(folder / PICTURE),
        "lines": [figure.line() for figure in figures],
    }
    told = {key: value for key, value in result.items() if key != "lines"}
    (folder / FIGURES).write_text(to_json(told, indent=1), encoding="utf-8")
    return result


def _path(text: str | None) -> Path | None:
    return None if text is None else Path(text)
