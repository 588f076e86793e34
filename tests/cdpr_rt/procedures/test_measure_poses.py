"""The procedure that reads poses, on an operator that is made up."""

from __future__ import annotations

import numpy as np
import pytest

from cdpr_rt.core.exchange import FloatArray
from cdpr_rt.errors import TripError
from cdpr_rt.procedures.calibration.measure_poses import (
    Look,
    Measured,
    PoseRefusedError,
    measure_poses,
)


class Operator:
    """A platform that refuses some places and shakes at others."""

    def __init__(self, shaky: float = -1.0, refused: float = -1.0) -> None:
        self.shaky, self.refused = shaky, refused
        self.here = np.zeros(2)
        self.looks = 0

    def go(self, place: FloatArray) -> None:
        if place[0] == self.refused:
            raise PoseRefusedError("cable 2 would need 200 N")
        self.here = place

    def stay(self, seconds: float) -> None:
        assert seconds > 0.0

    def look(self, seconds: float) -> Look:
        self.looks += 1
        lengths = np.tile(np.append(self.here, 1.0), (50, 1))
        if self.here[0] == self.shaky:
            lengths[25:] += 0.01
        return Look(lengths, np.full((50, 3), 40.0), np.append(self.here, 0.0), 0.001)


class Notes:
    def __init__(self) -> None:
        self.lines: list[str] = []

    def note(self, text: str) -> None:
        self.lines.append(text)


PLACES = [np.array([float(k), 2.0]) for k in range(1, 12)]


def test_it_reads_as_many_as_are_wanted() -> None:
    measured = Measured()
    measure_poses(Operator(), PLACES, 5, measured, Notes())
    assert [reading.target[0] for reading in measured.readings] == [1, 2, 3, 4, 5]
    last = measured.readings[-1]
    assert last.length_m == (5.0, 2.0, 1.0) and last.tension_N == (40.0,) * 3
    assert last.position_m == (5.0, 2.0, 0.0) and last.position_std_m == 0.001


def test_what_is_refused_or_shakes_is_left_out_with_its_reason() -> None:
    operator, measured, notes = Operator(shaky=3.0, refused=2.0), Measured(), Notes()
    measure_poses(operator, PLACES, 4, measured, notes)
    assert [reading.target[0] for reading in measured.readings] == [1, 4, 5, 6]
    assert "200 N" in measured.refused[0]
    assert "10.00 mm" in measured.refused[1] and "10.00 mm" in notes.lines[0]
    assert operator.looks == 4 + 10


def test_it_gives_up_where_nothing_comes_to_rest_and_keeps_what_it_has() -> None:
    measured = Measured()
    places = [PLACES[0], *[np.array([7.0, float(k)]) for k in range(9)]]
    with pytest.raises(TripError, match="5 poses in turn"):
        measure_poses(Operator(shaky=7.0), places, 20, measured, Notes())
    assert len(measured.readings) == 1 and len(measured.refused) == 5
