"""Markers that no image shows together: named, and no good calibration."""

from __future__ import annotations

from dataclasses import replace

import pytest

from cdpr_rt.calibration.calibrate import calibrate
from cdpr_rt.calibration.markers.coverage import coverage
from cdpr_rt.calibration.markers.sighting import Sighting
from tests.cdpr_rt.calibration.camera_robot import camera_robot


@pytest.mark.parametrize("apart", [True, False])
def test_islands_make_a_calibration_not_good(apart: bool) -> None:
    what = camera_robot(30)
    far = {2, 3, 6, 7, 10, 11}  # two columns of sheets

    def split(one: Sighting) -> Sighting:
        near = {k: corners for k, corners in one.corners_px.items() if k not in far}
        left = {k: corners for k, corners in one.corners_px.items() if k in far}
        return replace(one, corners_px=near if len(near) >= len(left) else left)

    sightings = [split(one) if apart else one for one in what.images.sightings]
    images = replace(what.images, sightings=sightings)
    outcome = calibrate(what.robot, what.geometry, what.seen, "camera", images)
    said = "\n".join(outcome.verdict())
    assert ("NOT GOOD: markers fall into 2 islands that no image connects" in said) == apart
    assert ("together with the others: take one that shows" in said) == apart
    assert len(outcome.as_json()["coverage"]["islands"]) == 1 + apart
    assert any("islands" in one for one in outcome.objections()) == apart
    assert not (outcome.good and apart)


def test_markers_seen_once_and_those_of_others_are_no_islands() -> None:
    def image(name: str, *markers: int) -> Sighting:
        return Sighting(name, dict.fromkeys(markers))  # type: ignore[arg-type]

    found = coverage([image("a", 1, 2), image("b", 2, 3), image("c", 7)], placed=[1, 2, 3, 7, 8])
    assert found.islands == ((1, 2, 3), (7,)) and not found.apart
    assert found.lines()[0] == "80% of the markers seen"
    others = [image("b", 11, 12), *(image(f"{k}", 7) for k in range(3))]
    assert coverage([image("a", 1, 2), *others]).apart == [(7,)]
    assert not coverage([image("a", 1, 2), *others], placed=[1, 2]).apart  # somebody else's
