"""Runs of the path with a robot on its simulator, recorded; one session is one start of it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np

from cdpr_rt.arrays import FloatArray
from cdpr_rt.service.streams.stream_packet import Standing
from cdpr_tools.errors import WorkFailedError
from cdpr_tools.experiment.model.parameters import OperatorParameters, Station
from cdpr_tools.experiment.path import centre_m, place_of, plane_of, targets_m
from cdpr_tools.experiment.trial import Condition, run_trial
from cdpr_tools.trials.run import TrialRun, trial_run

MARK = "path"
"""What the recording's events say of each run: the condition, and what the operator did."""

_PLAYED_S: Final = 0.3
"""Until the last packet that has arrived is played, and recorded."""


@dataclass(frozen=True)
class ExperimentSettings:
    """Settings of an experiment, stored beside what it measures."""

    robot: str
    plant: str | None
    commissioned: str | None
    compensated: bool
    seed: int
    operator: OperatorParameters
    station: Station
    places: tuple[str, ...]
    scales: tuple[float, ...]
    round_trips_s: tuple[float, ...]
    repeats: int

    def sessions(self) -> dict[str, tuple[Condition, ...]]:
        """Return the runs of each session by the session's name, in random order within it."""
        chance = np.random.default_rng(self.seed)
        return {
            f"{place}-{1e3 * round_trip_s:.0f}ms-{repeat}": tuple(
                Condition(place, self.scales[k], round_trip_s, repeat)
                for k in chance.permutation(len(self.scales))
            )
            for repeat in range(1, self.repeats + 1)
            for round_trip_s in self.round_trips_s
            for place in self.places
        }


class RobotPlant:
    """The plant of a run: packets go to the daemon's own session manager, cycles over the bus."""

    def __init__(self, run: TrialRun) -> None:
        self._rig = run.rig
        self._plane = list(plane_of(run.directions.k))
        self._stay = run.stay
        self._hand = run.rig.stream.sender()

    @property
    def now_s(self) -> float:
        """Bus time."""
        return self._rig.now_s

    @property
    def cycle(self) -> int:
        """Number of the present cycle."""
        return self._rig.cycle

    @property
    def truth_m(self) -> FloatArray:
        """Where the platform truly was at the last SYNC, in the pattern's plane, (2,)."""
        return np.array(self._rig.truth()["position_m"][self._plane])

    def advance(self, until_s: float) -> None:
        """Run cycles; raises WorkFailedError where the motion is ended meanwhile."""
        cycles = round((until_s - self._rig.now_s) / self._rig.period_s)
        if cycles > 0:
            self._stay(cycles * self._rig.period_s)

    def send(self, sent_s: float, hand_m: FloatArray, scale: float, buttons: int) -> None:
        """Hand a packet to the session manager; raises WorkFailedError where it is not taken."""
        moved = np.zeros(3)
        moved[self._plane] = hand_m
        packet = self._hand.packet(sent_s, moved.tolist(), scale, buttons)
        answer = self._rig.stream.take(packet)
        standing = None if answer is None else self._hand.answer_of(answer).standing
        if standing is not Standing.ACCEPTED:
            raise WorkFailedError(f"the robot did not take a packet of the stream: {standing}")


def run_session(
    settings: ExperimentSettings, conditions: Sequence[Condition], folder: Path
) -> None:
    """Start the robot once and run the path under each condition; all is recorded in `folder`.

    Raises WorkFailedError and BadInputError.
    """
    with trial_run(
        settings.robot,
        folder,
        plant=None if settings.plant is None else Path(settings.plant),
        seed=settings.seed,
        advance=lambda _: None,
        commissioned=None if settings.commissioned is None else Path(settings.commissioned),
        compensated=settings.compensated,
    ) as run:
        plant = RobotPlant(run)
        for condition in conditions:
            _run_path(run, plant, settings, condition, folder)


def _run_path(
    run: TrialRun,
    plant: RobotPlant,
    settings: ExperimentSettings,
    condition: Condition,
    folder: Path,
) -> None:
    centre = centre_m(run.rig.robot, condition.place)
    run.go(place_of(run.directions, centre))
    run.stay(1.0)
    run.rig.program("pose", stream=True)
    first = plant.cycle
    trial = run_trial(
        plant, condition, targets_m(centre), settings.operator, settings.station, settings.seed
    )
    run.stay(_PLAYED_S)
    np.save(folder / f"{condition.name}.npy", trial.ticks)
    values: dict[str, Any] = {
        "condition": asdict(condition),
        "first_cycle": first,
        "targets_m": trial.targets_m.tolist(),
        "points": list(trial.points),
    }
    run.mark(MARK, **values)
