"""The procedure that measures poses, with a fake operator."""

from __future__ import annotations

from collections.abc import Callable
from itertools import count
from pathlib import Path

import numpy as np
import pytest

from cdpr_profiles import load_robot
from cdpr_rt.arrays import FloatArray
from cdpr_rt.calibration.marker_map import Sighting
from cdpr_rt.errors import TripError
from cdpr_tools.calibrate.measure_poses import (
    DATA,
    NotThePoseError,
    PoseRefusedError,
    Readings,
    StoredPoses,
    TargetNotReached,
    measure_poses,
)
from cdpr_tools.calibrate.run import no_poses


class Operator:
    """A platform that rejects some places and shakes at others."""

    def __init__(
        self,
        shaky: float = -1.0,
        refused: float = -1.0,
        behind: float = -1.0,
        beyond: float = np.inf,
        held_on_way_to: float = -1.0,
    ) -> None:
        self.held_on_way_to, self.ended = held_on_way_to, dict[float, TripError]()
        self.shaky, self.refused, self.behind, self.beyond = shaky, refused, behind, beyond
        self.here = np.zeros(2)
        self.looks = 0
        self.marker: int | None = None
        self.trip: TripError | None = None
        self.gone: list[float] = []
        self.counted_m = np.zeros(3)

    def move_to(self, place: FloatArray) -> TargetNotReached | None:
        straight = self.here[0] == BETWEEN[0] or place[0] == BETWEEN[0]
        if place[0] == self.refused or (place[0] == self.behind and not straight):
            raise PoseRefusedError("cable 2 would need 200 N")
        if float(place[0]) in self.ended:
            raise self.ended[float(place[0])]
        self.gone.append(float(place[0]))
        if place[0] == self.held_on_way_to:
            self.here = 0.5 * (self.here + place)
            return TargetNotReached(self.here, "700 mm off after 12 s: no way on")
        self.here = np.minimum(place, self.beyond)
        if place[0] <= self.beyond:
            return None
        return TargetNotReached(self.here, "900 mm off after 14 s: cable 2 would need 200 N")

    def wait(self, seconds: float) -> None:
        assert seconds > 0.0

    def image(self) -> Sighting | None:
        if self.marker is None:
            return None
        return Sighting("now", {self.marker: np.arange(8.0).reshape(4, 2)}, repeated=(9,))

    def read(self, seconds: float) -> Readings:
        self.looks += 1
        if self.trip is not None:
            raise self.trip
        lengths = np.tile(np.append(self.here, 1.0), (50, 1))
        if self.here[0] == self.shaky:
            lengths[25:] += 0.01
        place = (*self.here.tolist(), 0.0)
        measured = {"position_m": place, "position_std_m": 0.001}
        return Readings(lengths, np.full((50, 3), 40.0), measured)


class Notes:
    def __init__(self) -> None:
        self.lines: list[str] = []

    def note(self, text: str) -> None:
        self.lines.append(text)


BETWEEN = np.array([0.5, 2.0])
PLACES = [np.array([float(k), 2.0]) for k in range(1, 12)]


Stored = Callable[[], StoredPoses]


@pytest.fixture
def stored(tmp_path: Path) -> Stored:
    """Return a function that makes the store of readings of a new measurement."""
    names = map(str, count())
    return lambda: StoredPoses(tmp_path / next(names), no_poses(load_robot("planar-4"), True))


def test_each_reading_is_saved_immediately_with_the_cameras_image(stored: Stored) -> None:
    operator = Operator()
    operator.marker = 4
    kept, counts = stored(), list[int]()
    kept.added = counts.append
    measure_poses(operator, PLACES[:5], BETWEEN, kept, Notes())
    assert [reading.target[0] for reading in kept.data.poses] == [1, 2, 3, 4, 5]
    assert counts == [1, 2, 3, 4, 5]
    assert (kept.folder / DATA).exists()
    last = kept.data.poses[-1]
    assert last.length_m == (5.0, 2.0, 1.0) and last.tension_N == (40.0,) * 3
    assert last.position_m == (5.0, 2.0, 0.0) and last.position_std_m == 0.001
    assert last.image is not None and last.image.repeated == (9,)
    assert last.image.sighting("x").corners_px[4].tolist() == [[0, 1], [2, 3], [4, 5], [6, 7]]


def test_rejected_or_shaking_poses_are_skipped_with_a_reason(stored: Stored) -> None:
    operator, notes = Operator(shaky=3.0, refused=2.0), Notes()
    kept = stored()
    measure_poses(operator, PLACES[:6], BETWEEN, kept, notes)
    assert [reading.target[0] for reading in kept.data.poses] == [1, 4, 5, 6]
    assert "200 N" in kept.data.left_out[0]
    assert "10.00 mm" in kept.data.left_out[1]
    assert notes.lines[0].startswith("pose 2, at 2.000, 2.000, is left out: cable 2")
    assert "pose 2, at 3.000" in notes.lines[1] and "10.00 mm" in notes.lines[1]
    assert kept.data.tried == ((2.0, 2.0), (3.0, 2.0))
    assert operator.looks == 4 + 10


def test_a_rejected_straight_way_is_replaced_by_a_detour(stored: Stored) -> None:
    operator = Operator(behind=3.0)
    kept = stored()
    measure_poses(operator, PLACES[:4], BETWEEN, kept, Notes())
    assert len(kept.data.poses) == 4 and not kept.data.left_out
    assert operator.gone == [1.0, 2.0, 0.5, 3.0, 4.0]


def test_a_platform_stopped_on_its_detour_is_measured_where_it_stands(stored: Stored) -> None:
    operator, notes = Operator(behind=3.0, held_on_way_to=0.5), Notes()
    kept = stored()
    measure_poses(operator, PLACES[:4], BETWEEN, kept, notes)
    assert operator.gone == [1.0, 2.0, 0.5, 4.0]
    assert [reading.target[0] for reading in kept.data.poses] == [1, 2, 1.25, 4]
    assert kept.data.tried == ((3.0, 2.0),) and not kept.data.left_out
    assert notes.lines == [
        "pose 3, at 3.000, 2.000, is read where the platform stands: on its way through "
        "0.500, 2.000 700 mm off after 12 s: no way on"
    ]
    shaky = Operator(behind=3.0, held_on_way_to=0.5, shaky=1.25)
    kept = stored()
    measure_poses(shaky, PLACES[:4], BETWEEN, kept, notes)
    assert shaky.gone == [1.0, 2.0, 0.5, 4.0] and len(kept.data.poses) == 3
    assert (
        "on its way through 0.500" in kept.data.left_out[0] and "10.00 mm" in kept.data.left_out[0]
    )


@pytest.mark.parametrize("ended_on_the_way", [True, False])
def test_a_trip_marks_the_pose_as_tried_unless_the_pose_was_not_its_cause(
    ended_on_the_way: bool, stored: Stored
) -> None:
    for error, tried in (
        (TripError("tension 140 N"), ((1.0, 2.0),)),
        (NotThePoseError("emergency stop"), ()),
    ):
        operator, kept = Operator(), stored()
        if ended_on_the_way:
            operator.ended[1.0] = error
        else:
            operator.trip = error
        with pytest.raises(type(error)):
            measure_poses(operator, PLACES[:4], BETWEEN, kept, Notes())
        assert kept.data.tried == tried and len(kept.data.left_out) == len(tried)
        assert not kept.data.poses


def test_five_shaking_poses_in_turn_end_the_measurement_and_keep_its_readings(
    stored: Stored,
) -> None:
    kept = stored()
    places = [PLACES[0], *[np.array([7.0, float(k)]) for k in range(9)]]
    with pytest.raises(TripError, match="5 poses in a row"):
        measure_poses(Operator(shaky=7.0), places, BETWEEN, kept, Notes())
    assert len(kept.data.poses) == 1 and len(kept.data.left_out) == 5


def test_at_most_five_consecutive_unreached_poses_are_measured_where_they_stand(
    stored: Stored,
) -> None:
    kept = stored()
    notes = Notes()
    measure_poses(Operator(beyond=8.0), PLACES[5:], BETWEEN, kept, notes)
    assert [reading.target[0] for reading in kept.data.poses] == [6, 7, 8, 8, 8, 8]
    assert [place[0] for place in kept.data.tried] == [9, 10, 11]
    assert notes.lines[0] == (
        "pose 4, at 9.000, 2.000, is read where the platform stands: 900 mm off after 14 s: "
        "cable 2 would need 200 N"
    )
    kept = stored()
    with pytest.raises(TripError, match=r"5 poses in a row failed, the last pose 7, at 9\.000"):
        measure_poses(Operator(beyond=4.0), PLACES[2:], BETWEEN, kept, notes)
    assert [reading.target[0] for reading in kept.data.poses] == [3, 4, 4, 4, 4, 4, 4]


def test_an_unreached_moving_pose_is_skipped_with_both_reasons(stored: Stored) -> None:
    kept, notes = stored(), Notes()
    measure_poses(Operator(beyond=8.0, shaky=8.0), PLACES[8:9], BETWEEN, kept, notes)
    assert not kept.data.poses and kept.data.tried == ((9.0, 2.0),)
    assert "900 mm off" in notes.lines[0] and "10.00 mm" in notes.lines[0]
