"""Two things wrong at once, with cables and camera: each is named, nothing else, and survived."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from cdpr_rt.calibration.calibrate import calibrate
from cdpr_rt.calibration.estimation.faults import Fault
from cdpr_rt.calibration.outcome import Outcome
from cdpr_rt.calibration.verification.verification import relative_errors
from tests.cdpr_rt.calibration.camera_robot import CameraRobot, camera_robot

_robot = cache(camera_robot)


class Readings:
    """What is read of a robot, and what is done to it."""

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
    """Return what of a fault counts: its kind, cable and pose, of a marker its number."""
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
def test_two_at_once_are_both_named_and_nothing_else_is(
    done: Callable[[Readings], object], named: set[tuple[object, ...]]
) -> None:
    readings = Readings(_robot())
    done(readings)
    outcome = readings.outcome()
    assert {_short(fault) for fault in outcome.faults} == named
    off, _ = relative_errors(outcome.found.poses, readings.what.made.poses)
    assert np.linalg.norm(off, axis=1).mean() < 3.5e-3


@pytest.mark.long
def test_four_cables_that_slip_at_once_are_named_but_might_be_the_camera() -> None:
    readings = Readings(_robot())
    slips = {0: 0.008, 1: 0.005, 2: -0.007, 3: 0.009}
    for cable, metres in slips.items():
        readings.slip(cable, 10, metres)
    outcome = readings.outcome()
    jumps = {one.cable: one for one in outcome.faults if one.kind == "jump"}
    assert {one.pose for one in jumps.values()} == {10}
    assert {cable: -one.size for cable, one in jumps.items()} == pytest.approx(slips, abs=1e-3)
    assert any("4 cables are off from pose 11 on" in text for text in outcome.objections())


@pytest.mark.long
def test_a_camera_that_is_moved_on_its_platform_is_not_taken_for_slips_alone() -> None:
    readings = Readings(_robot())
    readings.move_camera(10)
    readings.slip(6, 14, 0.008)
    outcome = readings.outcome()
    assert any(
        "off from pose 11 on: either they slipped together, or the camera was moved" in text
        for text in outcome.objections()
    )
    assert ("jump", 6, 14) in {_short(fault) for fault in outcome.faults}
