"""What is known of a simulated robot's camera before its calibration: lens by a board, sheets."""

from __future__ import annotations

from collections import Counter
from pathlib import Path

from cdpr_profiles.devices.camera import CameraIntrinsics, MarkerSheets, MarkerSize
from cdpr_rt.calibration.markers.images.charuco import Board, fit_intrinsics
from cdpr_rt.calibration.readings.camera_data import CameraSetup
from cdpr_sim_bus.camera.camera_plant import DEFAULT_SCENE, BoardPlant, CameraPlant, MountPlant
from cdpr_sim_bus.camera.random_poses import Box, random_poses
from cdpr_sim_bus.camera.sim_camera import SimCamera
from cdpr_sim_bus.robot.robot_plant import RobotPlant
from cdpr_tools.output import Output

_BOARD_IMAGES = 30
_BOARD_BOX = Box((-0.08, -0.06, 0.25), (0.08, 0.06, 0.5), 40.0)
"""Where the camera is held over the board, and how far it is tilted."""


def camera_setup(
    out: Output, plant: Path | None, intrinsics: Path | None, markers: Path | None
) -> CameraSetup:
    """Return the camera's setup: intrinsics and sheets of their files, else of the simulated ones.

    Without a file of intrinsics they are found as `cdpr camera calibrate` does, from images that
    the simulated camera takes of a board. Without one of markers, set, ids and sizes are those that
    were asked of the printer. Raises ProfileError, CalibrationError.
    """
    scene = CameraPlant() if plant is None else RobotPlant.load_file(plant).camera
    lens = CameraIntrinsics.load_file(intrinsics) if intrinsics else _by_board(out, scene)
    sheets = MarkerSheets.load_file(markers) if markers else _ordered(scene)
    return CameraSetup.of(lens, sheets)


def _by_board(out: Output, scene: CameraPlant) -> CameraIntrinsics:
    board = BoardPlant()
    before_board = scene.model_copy(
        update={
            "board": board, "grids": (), "markers": (), "occluders": (), "faults": (),
            "mount": MountPlant(position_m=(0.0, 0.0, 0.0)),
        }
    )  # fmt: skip
    with out.stage("camera: the simulated one is made"):
        camera = SimCamera(before_board)
    images = []
    with out.progress("camera: images of a ChArUco board", float(_BOARD_IMAGES)) as advance:
        for k, state in enumerate(random_poses(_BOARD_BOX, _BOARD_IMAGES, scene.seed)):
            images.append((f"board {k + 1}", camera.grab(state)))
            advance(k + 1.0)
    known = Board(board.columns, board.rows, board.square_m, board.marker_m, board.dictionary)
    with out.stage("camera: fitting its lens to these images"):
        found = fit_intrinsics(images, known)
    one = found.intrinsics
    out.say(
        f"camera: intrinsics from {len(found.used)} images of a ChArUco board, corners fit to "
        f"{one.rms_px:.3f} px; focal lengths {one.focal_px[0]:.1f} and {one.focal_px[1]:.1f} px",
        *(f"camera: missing: {text}" for text in found.missing),
    )
    return one


def _ordered(scene: CameraPlant) -> MarkerSheets:
    """Return the sheets as they were ordered: where they lie and how they came out is not known."""
    grids = scene.grids or (() if scene.markers else DEFAULT_SCENE)
    sizes = [
        (grid.first_id + k, grid.size_m) for grid in grids for k in range(grid.rows * grid.columns)
    ]
    sizes += [(one.id, one.size_m) for one in scene.markers]
    usual = Counter(size for _, size in sizes).most_common(1)[0][0]
    others = sorted({size for _, size in sizes} - {usual})
    return MarkerSheets(
        dictionary=scene.dictionary,
        size_m=usual,
        sizes=tuple(MarkerSize(ids=_ids(sizes, other), size_m=other) for other in others),
        placed=_ids(sizes, None),
    )


def _ids(sizes: list[tuple[int, float]], size_m: float | None) -> tuple[int, ...]:
    """Return the ids of one size, or all, each once."""
    return tuple(sorted({marker for marker, size in sizes if size_m is None or size == size_m}))
