"""Simultaneous faults of cables and camera are all reported, and nothing else."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from cdpr_rt.calibration.calibrate import calibrate
from cdpr_rt.calibration.faults import Fault
from cdpr_rt.calibration.marker_map import Sighting, coverage
from cdpr_rt.calibration.outcome import Outcome
from cdpr_rt.calibration.verification import relative_errors
from tests.cdpr_rt.calibration.camera_robot import FEW, CameraRobot, camera_robot

_robot = cache(camera_robot)


class Readings:
    """Readings of a robot, and faults to apply."""

    def __init__(self, what: CameraRobot) -> None:
        self.what = what
        self.length_m, self.tension_N = what.seen.length_m.copy(), what.seen.tension_N.copy()
        self.sightings = [
            replace(one, corners_px=dict(one.corners_px)) for one in what.images.sightings
        ]
        self.setup = what.images.setup

    def outcome(self) -> Outcome:
        seen = replace(self.what.seen, length_m=self.length_m, tension_N=self.tension_N)
        images = replace(self.what.images, sightings=self.sightings, setup=self.setup)
        return calibrate(self.what.robot, self.what.geometry, seen, "camera", images)

    def off_mm(self, outcome: Outcome) -> float:
        """Return the mean error of positions relative to the first pose."""
        off, _ = relative_errors(outcome.found.poses, self.what.made.poses)
        return 1e3 * float(np.linalg.norm(off, axis=1).mean())

    def slip(self, cable: int, pose: int, metres: float) -> None:
        self.length_m[pose:, cable] += metres

    def catch(self, cable: int, pose: int, metres: float) -> None:
        self.length_m[pose, cable] += metres

    def slacken(self, cable: int, poses: Sequence[int]) -> None:
        self.tension_N[poses, cable] = 0.5
        self.length_m[poses, cable] += 0.03

    def wrong_drum(self, cable: int, share: float) -> None:
        home = self.length_m[0, cable]
        self.length_m[:, cable] = home + (self.length_m[:, cable] - home) / (1.0 + share)

    def wrong_size(self, times: float) -> None:
        size_m = times * self.setup.sheets.size_m
        sheets = self.setup.sheets.model_copy(update={"size_m": size_m})
        self.setup = self.setup.model_copy(update={"sheets": sheets})

    def wrong_lens(self, times: float) -> None:
        given = self.setup.intrinsics
        focal_px = tuple(times * one for one in given.focal_px)
        intrinsics = given.model_copy(update={"focal_px": focal_px})
        self.setup = self.setup.model_copy(update={"intrinsics": intrinsics})

    def move(self, marker: int, pose: int) -> None:
        self._change(marker, pose, lambda corners: np.add(corners, (45.0, 0.0)))

    def print_larger(self, marker: int, times: float) -> None:
        self._change(
            marker, 0, lambda corners: corners.mean(axis=0) + times * (corners - corners.mean(0))
        )

    def move_camera(self, pose: int) -> None:
        for marker in range(12):
            self._change(marker, pose, lambda corners: np.add(corners, (8.0, 3.0)))

    def misplace_camera(self, sigmas: float) -> None:
        told = self.setup.hand_eye
        assert told is not None
        off_m = sigmas * told.position_std_m
        place = tuple(x + off for x, off in zip(told.position_m, (off_m, -off_m, 0.0), strict=True))
        hand_eye = told.model_copy(update={"position_m": place})
        self.setup = self.setup.model_copy(update={"hand_eye": hand_eye})

    def exchange_known(self, first: int, second: int) -> None:
        other = {first: second, second: first}
        known = tuple(
            one.model_copy(update={"id": other.get(one.id, one.id)})
            for one in self.setup.sheets.known
        )
        sheets = self.setup.sheets.model_copy(update={"known": known})
        self.setup = self.setup.model_copy(update={"sheets": sheets})

    def _change(self, marker: int, pose: int, change: Callable[[np.ndarray], np.ndarray]) -> None:
        for one in self.sightings[pose:]:
            if marker in one.corners_px:
                one.corners_px[marker] = change(one.corners_px[marker])  # type: ignore[index]

    def blacken(self, poses: Sequence[int]) -> None:
        for j in poses:
            self.sightings[j] = replace(self.sightings[j], corners_px={}, problem="black")

    def unplug(self, poses: Sequence[int]) -> None:
        for j in poses:
            self.sightings[j] = replace(self.sightings[j], corners_px={})

    def print_twice(self, marker: int) -> None:
        for j, one in enumerate(self.sightings):
            rest = {key: value for key, value in one.corners_px.items() if key != marker}
            self.sightings[j] = replace(one, corners_px=rest, repeated=(marker,))


def _short(fault: Fault) -> tuple[object, ...]:
    """Return kind, cable and pose of a fault, or the number of a marker."""
    if fault.kind == "marker":
        return ("marker", fault.text.split()[1])
    return (fault.kind, fault.cable, fault.pose)


@pytest.mark.parametrize(
    ("done", "named"),
    [
        (
            lambda one: (one.move(5, 10), one.wrong_size(1.04)),
            {("marker", "5"), ("size", -1, -1)},
        ),
        (
            lambda one: (one.slip(6, 10, 0.008), one.wrong_lens(1.03)),
            {("jump", 6, 10), ("lens", -1, -1)},
        ),
        (
            lambda one: (one.wrong_drum(2, 0.03), one.blacken([3, 6, 12, 17])),
            {("drum", 2, -1), *(("image", -1, j) for j in (3, 6, 12, 17))},
        ),
        (
            lambda one: (one.slacken(6, [8, 9, 10]), one.slip(6, 12, 0.008)),
            {*(("slack", 6, j) for j in (8, 9, 10)), ("jump", 6, 12)},
        ),
        (
            lambda one: (one.print_twice(5), one.unplug([3, 4, 5, 16])),
            {("marker", "5")},
        ),
        (
            lambda one: (one.catch(3, 7, 0.025), one.print_larger(5, 1.1)),
            {("outlier", 3, 7), ("marker", "5")},
        ),
        (
            lambda one: (one.slip(2, 10, 0.008), one.wrong_drum(2, 0.03)),
            {("jump", 2, 10), ("drum", 2, -1)},
        ),
    ],
    ids=["moved, size", "slip, lens", "drum, black", "slack, slip", "twice, unplugged",
         "caught, one size", "slip, drum"],
)  # fmt: skip
def test_two_simultaneous_faults_are_both_reported_and_nothing_else(
    done: Callable[[Readings], object], named: set[tuple[object, ...]]
) -> None:
    readings = Readings(_robot())
    done(readings)
    outcome = readings.outcome()
    assert {_short(fault) for fault in outcome.faults} == named
    assert readings.off_mm(outcome) < 3.5


def test_slipped_encoders_and_faulty_markers_are_reported_and_tolerated() -> None:
    readings = Readings(_robot())
    readings.slip(6, 10, 0.008)
    readings.slip(1, 15, -0.006)
    readings.blacken([4])
    readings.move(5, 10)
    readings.sightings[6] = replace(readings.sightings[6], repeated=(11,))
    readings.sightings[1] = replace(readings.sightings[1], mirrored=(12,))
    outcome = readings.outcome()
    words = "\n".join(fault.text for fault in outcome.faults)
    jumps = {(one.cable, one.pose): one.size for one in outcome.faults if one.kind == "jump"}
    assert jumps == pytest.approx({(6, 10): -0.008, (1, 15): 0.006}, abs=1e-3)
    for said in (
        "slipped", "from pose 11 on", "pose 5: black", "marker 11 is twice in 1 images",
        "marker 12 is printed as a mirror", "marker 5 was moved by",
    ):  # fmt: skip
        assert said in words
    assert readings.off_mm(outcome) < 3.0


def test_cable_lengths_reveal_a_wrong_size_of_all_sheets() -> None:
    readings = Readings(_robot(layout=replace(FEW, known=3)))
    readings.wrong_size(1.04)
    outcome = readings.outcome()
    (sized,) = (fault for fault in outcome.faults if fault.kind == "size")
    assert "smaller than stated" in sized.text
    assert sized.size == pytest.approx(-0.0385, abs=0.008)
    assert readings.off_mm(outcome) < 3.0
    assert "known places of markers" in outcome.as_json()["frame"]


@pytest.mark.parametrize("drums", [(0.02,) * 8, (0.0, 0.0, 0.03, 0.0, 0.0, 0.0, 0.0, 0.0)])
def test_wrong_sizes_of_sheets_and_drums_are_distinguished(drums: tuple[float, ...]) -> None:
    readings = Readings(_robot())
    readings.wrong_size(1.04)
    for cable, share in enumerate(drums):
        readings.wrong_drum(cable, share)
    outcome = readings.outcome()
    size, *others = (fault for fault in outcome.faults if fault.kind in ("size", "drum"))
    assert size.kind == "size" and size.size == pytest.approx(-0.0385, abs=0.004)
    assert [(one.kind, one.cable) for one in others] == [("drum", -1 if all(drums) else 2)]
    assert others[0].size == pytest.approx(max(drums), abs=0.004)
    assert readings.off_mm(outcome) < 3.5


@pytest.mark.parametrize(("size", "drum"), [(1.04, 0.0), (1.0, 0.02)])
def test_a_wrong_lens_and_wrong_sizes_of_sheets_or_drums_are_distinguished(
    size: float, drum: float
) -> None:
    readings = Readings(_robot())
    readings.wrong_lens(1.03)
    readings.wrong_size(size)
    for cable in range(8):
        readings.wrong_drum(cable, drum)
    outcome = readings.outcome()
    sizes = {one.kind: one.size for one in outcome.faults if one.kind in ("size", "drum", "lens")}
    other = {"drum": drum} if drum else {"size": 1.0 / size - 1.0}
    assert sizes == pytest.approx({**other, "lens": 1.0 / 1.03 - 1.0}, abs=0.005)
    assert readings.off_mm(outcome) < 3.5


@pytest.mark.long
def test_a_moved_camera_is_reported_as_possible_cause_of_several_slips() -> None:
    readings = Readings(_robot())
    readings.move_camera(10)
    readings.slip(6, 14, 0.008)
    outcome = readings.outcome()
    assert any(
        "off from pose 11 on: either they slipped together, or the camera moved" in text
        for text in outcome.objections()
    )
    assert ("jump", 6, 14) in {_short(fault) for fault in outcome.faults}


def test_three_faults_are_reported_despite_a_wrong_camera_position() -> None:
    readings = Readings(_robot())
    readings.slip(6, 10, 0.008)
    readings.catch(3, 7, 0.025)
    readings.move(5, 10)
    readings.misplace_camera(6.0)
    outcome = readings.outcome()
    named = {_short(fault) for fault in outcome.faults}
    assert named == {
        ("jump", 6, 10), ("outlier", 3, 7), ("marker", "5"), ("hand_eye", -1, -1),
    }  # fmt: skip
    assert readings.off_mm(outcome) < 3.5


def test_exchanged_known_markers_do_not_move_the_calibration() -> None:
    what = camera_robot(layout=replace(FEW, known=4))
    right, readings = Readings(what).outcome(), Readings(what)
    ids = [one.id for one in readings.setup.sheets.known]
    readings.exchange_known(ids[0], ids[2])
    outcome = readings.outcome()
    assert right.known_room and outcome.known_room
    assert not [fault for fault in right.faults if fault.kind == "place"]
    places = [fault.text for fault in outcome.faults if fault.kind == "place"]
    assert len(places) == 1
    first, second = sorted((ids[0], ids[2]))
    assert places[0].startswith(f"markers {first}, {second} are exchanged")
    off_m = outcome.found.poses[:, 0] - right.found.poses[:, 0]
    assert np.linalg.norm(off_m, axis=1).mean() < 1e-3 * outcome.absolute.position_mm


def test_a_calibration_with_islands_is_not_good() -> None:
    readings = Readings(camera_robot(30))
    far = {2, 3, 6, 7, 10, 11}  # two columns of sheets
    for j, one in enumerate(readings.sightings):
        near = {k: corners for k, corners in one.corners_px.items() if k not in far}
        left = {k: corners for k, corners in one.corners_px.items() if k in far}
        shown = near if len(near) >= len(left) else left
        readings.sightings[j] = replace(one, corners_px=shown)
    outcome = readings.outcome()
    said = "\n".join(outcome.verdict())
    assert "NOT GOOD: markers fall into 2 islands that no image connects" in said
    assert "together with the others: take one that shows" in said
    assert len(outcome.as_json()["coverage"]["islands"]) == 2
    assert not outcome.good


def test_markers_seen_once_and_foreign_markers_are_not_islands() -> None:
    def image(name: str, *markers: int) -> Sighting:
        return Sighting(name, dict.fromkeys(markers))  # type: ignore[arg-type]

    found = coverage([image("a", 1, 2), image("b", 2, 3), image("c", 7)], placed=[1, 2, 3, 7, 8])
    assert found.islands == ((1, 2, 3), (7,)) and not found.apart
    assert found.lines()[0] == "80% of the markers seen"
    others = [image("b", 11, 12), *(image(f"{k}", 7) for k in range(3))]
    assert coverage([image("a", 1, 2), *others]).apart == [(7,)]
    assert not coverage([image("a", 1, 2), *others], placed=[1, 2]).apart  # a foreign marker
