"""Marker maps from corners: accuracy, standard deviations, and reported faults."""

from __future__ import annotations

import dataclasses

import cv2
import numpy as np
import pytest
from marker_room import LENS, Room, difference, intrinsics, room, seen_from
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

from cdpr_profiles.camera import KnownMarker, MarkerSheets, MarkerSize
from cdpr_rt.calibration.camera_geometry import angles, project
from cdpr_rt.calibration.marker_bundle import Estimate, adjust
from cdpr_rt.calibration.marker_map import CORNERS, SeenMarkers, Sighting, best_fit, coverage
from cdpr_rt.calibration.marker_map_fit import (
    MapFit,
    Suspect,
    first_map,
    fit_map,
    square_poses,
    verdict,
    warnings,
)
from cdpr_rt.errors import InvalidRequestError

SHEETS = MarkerSheets(size_m=0.15)
ODD = 9
"""The number of a marker in the middle of the room."""


@pytest.fixture(scope="module")
def one() -> Room:
    return room(1)


@pytest.fixture(scope="module")
def plain(one: Room) -> MapFit:
    return fit_map(one.sightings(), intrinsics(), SHEETS)


def known_places(one: Room, *ids: int) -> tuple[KnownMarker, ...]:
    map_ = one.truth
    turns = Rotation.from_matrix(map_.rotation).as_rotvec(degrees=True)
    return tuple(
        KnownMarker(
            id=marker,
            position_m=tuple(map_.position_m[map_.ids.index(marker)].tolist()),
            rotation_deg=tuple(turns[map_.ids.index(marker)].tolist()),
        )
        for marker in ids
    )


def test_a_map_is_as_accurate_as_it_claims(one: Room, plain: MapFit) -> None:
    assert not plain.faults
    assert not plain.warnings
    assert verdict(plain).startswith("good: 20 markers from 25 images")
    off = difference(plain.map, one.truth)
    known = np.linalg.norm(plain.bundle.marker_sigma_m, axis=1)
    assert off.position_error_m.max() < 4.0 * known.max()
    assert off.position_error_m.max() < 0.004
    assert plain.bundle.sigma_px == pytest.approx(0.05, rel=0.1)


def test_standard_deviations_agree_with_many_maps() -> None:
    base = room(2, rows=3, columns=4, images=15, noise_px=0.0)
    reference = 5
    chance = np.random.default_rng(9)
    start = Estimate(seen_from(base.truth, reference), LENS)
    weighed = []
    for _ in range(60):
        noise = chance.normal(0.0, 0.1, base.seen.corners_px.shape)
        seen = dataclasses.replace(base.seen, corners_px=base.seen.corners_px + noise)
        bundle = adjust(start, seen, (reference,))
        off = bundle.estimate.map.position_m - start.map.position_m
        for k, marker in enumerate(base.seen.ids):
            if marker != reference:
                weighed.append(off[k] @ np.linalg.solve(bundle.marker_covariance_m2[k], off[k]))
    # mean of chi square with 3 degrees of freedom
    assert np.mean(weighed) == pytest.approx(3.0, rel=0.15)


def test_the_fit_agrees_with_an_independent_solver() -> None:
    base = room(3, rows=2, columns=3, images=4, noise_px=0.1)
    poses = square_poses(base.seen, LENS)
    first = first_map(base.seen, poses)
    bundle = adjust(Estimate(first, LENS), base.seen, (first.reference,))
    start = Estimate(bundle.estimate.map, LENS)
    sigma = np.sqrt(np.diag(bundle.covariance))
    free, root = np.flatnonzero(sigma), np.sqrt(bundle.weight)[..., None]

    def off(x: np.ndarray) -> np.ndarray:
        step, moves = np.zeros(start.parameters), x[len(free) :].reshape(-1, 6)
        step[free] = x[: len(free)]
        return np.asarray(root * start.changed(step, moves).off_px(base.seen)).ravel()

    begin = np.full(len(free) + 6 * len(base.seen.names), 1e-4)
    solved = least_squares(off, begin, method="lm").x[: len(free)]
    assert np.abs(solved / sigma[free]).max() < 0.1


@pytest.mark.parametrize("seed", [11, 12, 13])
def test_ambiguous_small_markers_get_the_right_orientation(seed: int) -> None:
    one = room(seed, size_m=0.05, noise_px=0.15, tilt_deg=8.0)
    fit = fit_map(one.sightings(), intrinsics(), MarkerSheets(size_m=0.05))
    assert not fit.faults
    assert difference(fit.map, one.truth).rotation_error_rad.max() < 0.06


def test_out_of_plane_errors_of_a_map_are_mostly_tilt_of_its_reference_marker() -> None:
    # figures 3.20 and 3.21 of the thesis show errors in the frame of one small marker
    one = room(4, noise_px=0.1)
    fit = fit_map(one.sightings(), intrinsics(), SHEETS, reference=7)
    off = difference(fit.map, one.truth)
    sigma = np.sqrt((fit.bundle.marker_sigma_m**2).mean(axis=0))
    assert sigma[2] > 3.0 * sigma[:2].max()
    far = off.distance_m > np.median(off.distance_m)
    assert off.position_error_m[far].mean() > off.position_error_m[~far].mean()
    turn, shift = best_fit(fit.map.position_m, one.truth.position_m)
    left = fit.map.position_m @ turn.T + shift - one.truth.position_m
    told = np.sqrt((fit.bundle.shape_sigma_m**2).sum(axis=1).mean())
    assert np.sqrt((left**2).sum(axis=1).mean()) < 2.0 * told
    assert told < 0.5 * sigma[2]
    assert any("the tilt of one sheet is not well known" in note for note in fit.notes)


def test_markers_never_seen_together_are_reported_as_islands_with_advice(one: Room) -> None:
    split = []
    for sight in one.sightings():
        left = {i: c for i, c in sight.corners_px.items() if i % 5 < 3}
        right = {i: c for i, c in sight.corners_px.items() if i % 5 >= 3}
        shown = left if len(left) > len(right) else right
        split.append(Sighting(sight.name, shown))
    found = coverage(split, placed=range(21))
    assert [len(island) for island in found.islands] == [12, 8]
    assert found.unseen == (20,)
    assert found.share_seen == pytest.approx(20 / 21)
    assert any("no image shows markers 3, 4" in line for line in found.advice)
    fit = fit_map(split, intrinsics(), SHEETS)
    assert "2 islands" in fit.faults[0]
    assert fit.map.placed.sum() == 12


def test_a_misread_id_does_not_join_groups_of_markers(one: Room) -> None:
    left, right = ({k for k in range(20) if (k % 5 < 3) == side} for side in (True, False))
    shown = [
        Sighting(sight.name, {i: c for i, c in sight.corners_px.items() if i in which})
        for sight, which in zip(one.sightings(), [left, right] * 13, strict=False)
    ]
    square = np.array([(300.0, 200.0), (340.0, 202.0), (338.0, 241.0), (299.0, 240.0)])
    for k in (6, 9):  # one marker of each group
        shown[k] = Sighting(shown[k].name, {**shown[k].corners_px, 33: square}, (34,), (), (35,))
    joined = fit_map(shown, intrinsics(), SHEETS)
    assert difference(joined.map, one.truth).position_error_m.max() > 0.05
    fit = fit_map(shown, intrinsics(), SHEETS.model_copy(update={"placed": tuple(range(20))}))
    assert "2 islands" in fit.faults[0] and not fit.warnings
    assert fit.map.placed.sum() == 12 and 33 not in fit.map.ids
    assert difference(fit.map, one.truth).position_error_m.max() < 0.004
    assert any(
        "marker 33 detected, but not among the markers laid out" in note for note in fit.notes
    )


def test_a_map_requires_images_with_two_markers() -> None:
    alone = [Sighting("a", {}), Sighting("b", {3: np.zeros((4, 2))})]
    with pytest.raises(InvalidRequestError, match="no image shows two markers"):
        fit_map(alone, intrinsics(), SHEETS)


def test_a_moved_marker_is_reported_with_the_image(one: Room) -> None:
    moved = one.with_marker_off(ODD, (0.04, 0.02, 0.0), lambda i: i >= 12)
    fit = fit_map(moved.sightings(), intrinsics(), SHEETS)
    assert len(fit.warnings) == 1
    assert f"marker {ODD} was moved by 4" in fit.warnings[0]
    assert "between image 1" in fit.warnings[0]
    assert not fit.faults
    keep = fit.map.placed
    assert ODD not in np.array(fit.map.ids)[keep]
    assert difference(fit.map, one.truth).position_error_m.max() < 0.004


def test_a_partly_covered_marker_is_not_reported_as_moved(one: Room) -> None:
    # a sheet above hides the right half: these corners are where edges disappear beneath it
    own = one.truth.rotation[one.truth.ids.index(ODD)]
    hidden = np.array([(0.0, -0.02, 0.0), (-0.07, -0.008, 0.0), (-0.05, 0.0, 0.0), (0.0, 0.0, 0.0)])
    covered = one.with_corners_off(ODD, hidden @ own.T, lambda i: i >= 14)
    fit = fit_map(covered.sightings(), intrinsics(), SHEETS)
    (warning,) = fit.warnings
    assert f"marker {ODD} is partly covered in" in warning and "moved" not in warning
    k = fit.map.ids.index(ODD)
    assert fit.map.placed[k]
    assert difference(fit.map, one.truth).position_error_m.max() < 0.004
    images = fit.seen.image[fit.seen.marker == k]
    assert len(images) and images.max() < 14


def test_a_marker_moved_twice_is_not_reported_as_partly_covered(one: Room) -> None:
    moved = one.with_marker_off(ODD, (0.04, 0.02, 0.0), lambda i: i >= 12)
    moved = moved.with_marker_off(ODD, (0.05, -0.25, 0.0), lambda i: i >= 17)
    fit = fit_map(moved.sightings(), intrinsics(), SHEETS)
    (warning,) = fit.warnings
    assert f"marker {ODD} " in warning and "covered" not in warning
    assert ODD not in np.array(fit.map.ids)[fit.map.placed]
    assert difference(fit.map, one.truth).position_error_m.max() < 0.004


def test_each_faulty_marker_gives_one_warning() -> None:
    found = [
        Suspect(9, "covered", "marker 9 is partly covered", (3, 4)),
        Suspect(2, "twice", "marker 2 appears twice"),
        Suspect(9, "moved", "marker 9 was moved"),
    ]
    said = ["marker 9 is partly covered; without these: marker 9 was moved"]
    assert warnings([], found) == [*said, "marker 2 appears twice"]


def test_a_duplicate_id_is_reported(one: Room) -> None:
    twice = one.with_marker_off(ODD, (0.6, 0.0, 0.0), lambda i: i % 2 == 0)
    fit = fit_map(twice.sightings(), intrinsics(), SHEETS)
    assert any(f"marker {ODD} appears twice" in line for line in fit.warnings)
    assert difference(fit.map, one.truth).position_error_m.max() < 0.004
    both = [dataclasses.replace(one.sightings()[0], repeated=(33,)), *one.sightings()[1:]]
    assert "printed twice" in fit_map(both, intrinsics(), SHEETS).warnings[0]


def test_a_sheet_of_a_different_size_is_reported_with_its_size(one: Room) -> None:
    told = MarkerSheets(size_m=0.15, sizes=(MarkerSize(ids=(ODD,), size_m=0.145),))
    fit = fit_map(one.sightings(), intrinsics(), told)
    assert f"marker {ODD} is +3." in fit.warnings[0]


def test_only_known_places_reveal_a_wrong_size_of_all_sheets(one: Room) -> None:
    wrong = MarkerSheets(size_m=0.153)
    blind = fit_map(one.sightings(), intrinsics(), wrong)
    assert not blind.faults
    assert any("images alone cannot verify it" in note for note in blind.notes)
    told = wrong.model_copy(update={"known": known_places(one, 0, 8, 19)})
    fit = fit_map(one.sightings(), intrinsics(), told)
    assert fit.known is not None
    assert fit.known.scale == pytest.approx(0.15 / 0.153, rel=1e-3)
    assert any("0.980" in fault for fault in fit.faults)


def test_known_places_define_the_frame_and_are_kept(one: Room) -> None:
    told = SHEETS.model_copy(update={"known": known_places(one, 0, 8, 19)})
    fit = fit_map(one.sightings(), intrinsics(), told)
    assert not fit.faults
    assert fit.fixed == (0, 8, 19)
    assert np.linalg.norm(fit.map.position_m - one.truth.position_m, axis=1).max() < 0.003
    single = SHEETS.model_copy(update={"known": known_places(one, 8)})
    fit = fit_map(one.sightings(), intrinsics(), single)
    assert fit.fixed == (8,) and fit.known is None
    assert np.linalg.norm(fit.map.position_m - one.truth.position_m, axis=1).max() < 0.02


def exchanged(known: tuple[KnownMarker, ...], i: int, j: int) -> tuple[KnownMarker, ...]:
    """Return known markers with the places of two exchanged."""
    ids = [one.id for one in known]
    ids[i], ids[j] = ids[j], ids[i]
    return tuple(
        one.model_copy(update={"id": marker}) for one, marker in zip(known, ids, strict=True)
    )


@pytest.mark.parametrize("ids", [(0, 19), (0, 8, 19), (0, 4, 15, 19), (0, 3, 4, 8, 15, 19)])
def test_exchanged_known_markers_are_reported_and_do_not_distort_the_map(
    one: Room, ids: tuple[int, ...]
) -> None:
    known = exchanged(known_places(one, *ids), 0, len(ids) - 1)
    fit = fit_map(one.sightings(), intrinsics(), SHEETS.model_copy(update={"known": known}))
    assert len(fit.faults) == 1, fit.faults
    assert fit.faults[0].startswith("markers 0, 19 are exchanged")
    turn, shift = best_fit(fit.map.position_m, one.truth.position_m)
    off = fit.map.position_m @ turn.T + shift - one.truth.position_m
    assert np.linalg.norm(off, axis=1).max() < 0.003


def test_a_wrong_known_place_is_reported_and_omitted(one: Room) -> None:
    known = list(known_places(one, 0, 4, 15, 19))
    x, *rest = known[2].position_m
    known[2] = known[2].model_copy(update={"position_m": (x + 0.2, *rest)})
    fit = fit_map(one.sightings(), intrinsics(), SHEETS.model_copy(update={"known": tuple(known)}))
    assert len(fit.faults) == 1 and "marker 15 does not lie at its known place" in fit.faults[0]
    assert fit.fixed == (0, 4, 19)


def test_known_places_without_a_consistent_majority_are_all_omitted(one: Room) -> None:
    known, rng = known_places(one, 0, 4, 15, 19), np.random.default_rng(3)
    off = [tuple((np.array(k.position_m) + rng.uniform(-1, 1, 3)).tolist()) for k in known]
    wrong = tuple(k.model_copy(update={"position_m": p}) for k, p in zip(known, off, strict=True))
    fit = fit_map(one.sightings(), intrinsics(), SHEETS.model_copy(update={"known": wrong}))
    assert "is not known which are wrong" in fit.faults[0]
    assert len(fit.fixed) == 1 and fit.known is None


@pytest.mark.parametrize(
    "change", [(0, 0.02), (4, -1.0)], ids=["another focal length", "no distortion"]
)
def test_intrinsics_of_another_camera_are_recognised(one: Room, change: tuple[int, float]) -> None:
    lens = LENS.copy()
    at, share = change
    lens[at : at + (2 if at == 0 else 5)] *= 1.0 + share
    fit = fit_map(one.sightings(), intrinsics(lens), SHEETS)
    assert fit.lens.wrong
    assert "intrinsics do not fit the camera" in fit.faults[0]
    if at == 0:
        assert fit.lens.focal_change == pytest.approx(-0.0196, abs=0.004)


def test_a_missing_reference_marker_is_rejected(one: Room) -> None:
    with pytest.raises(InvalidRequestError, match="reference marker 77 is not in the map"):
        fit_map(one.sightings(), intrinsics(), SHEETS, reference=77)
    assert fit_map(one.sightings(), intrinsics(), SHEETS, reference=3).map.reference == 3


def test_uncertainty_of_a_map_includes_errors_of_the_sheets(one: Room, plain: MapFit) -> None:
    assert plain.bundle.sheets.inflation == 1.0
    chance = np.random.default_rng(6)
    # sizes in the file differ by 0.2 % each, like errors of the printer
    sizes = tuple(
        MarkerSize(ids=(marker,), size_m=float(0.15 * (1.0 + chance.normal(0.0, 0.002))))
        for marker in one.seen.ids
    )
    fit = fit_map(one.sightings(), intrinsics(), SHEETS.model_copy(update={"sizes": sizes}))
    assert fit.bundle.sheets.inflation > 2.0
    turn, shift = best_fit(fit.map.position_m, one.truth.position_m)
    left = fit.map.position_m @ turn.T + shift - one.truth.position_m
    told = np.sqrt((fit.bundle.shape_sigma_m**2).sum(axis=1).mean())
    assert np.sqrt((left**2).sum(axis=1).mean()) < 2.0 * told
    assert any("off on their sheets" in note for note in fit.notes)


MATRIX = np.array([[LENS[0], 0, LENS[2]], [0, LENS[1], LENS[3]], [0, 0, 1.0]])


def test_projection_of_points_agrees_with_opencv() -> None:
    chance = np.random.default_rng(3)
    points = np.column_stack([chance.uniform(-0.4, 0.4, (50, 2)), chance.uniform(0.9, 2.0, 50)])
    seen = project(points, LENS)
    theirs, _ = cv2.projectPoints(points, np.zeros(3), np.zeros(3), MATRIX, LENS[4:])
    np.testing.assert_allclose(seen, theirs.reshape(-1, 2), atol=1e-9)


def test_one_of_the_two_poses_of_a_square_is_the_true_one() -> None:
    chance = np.random.default_rng(4)
    turns = Rotation.from_rotvec([np.pi, 0, 0]) * Rotation.from_rotvec(
        chance.normal(0.0, 0.4, (80, 3))
    )
    places = chance.uniform((-0.3, -0.25, 0.9), (0.3, 0.25, 1.5), (80, 3))
    rows = [
        (i, 7, project(0.15 * CORNERS @ turn.T + place, LENS))
        for i, (turn, place) in enumerate(zip(turns.as_matrix(), places, strict=True))
    ]
    poses = square_poses(SeenMarkers.of(map(str, range(80)), rows, {7: 0.15}), LENS)
    off = angles(poses.rotation @ turns.inv().as_matrix()[:, None])
    assert off[:, 0].max() < 1e-5
    np.testing.assert_allclose(poses.position_m[:, 0], places, atol=1e-6)
    assert (off[:, 1] > 1e-3).sum() > 40


def test_duplicate_or_sizeless_markers_are_rejected() -> None:
    corners = np.zeros((4, 2))
    with pytest.raises(Exception, match="marker 3 appears twice in image number 0"):
        SeenMarkers.of(["a"], [(0, 3, corners), (0, 3, corners)], {3: 0.1})
    with pytest.raises(Exception, match="marker 4 was seen, but its size is not stated"):
        SeenMarkers.of(["a"], [(0, 3, corners), (0, 4, corners)], {3: 0.1})
