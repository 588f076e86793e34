"""The surroundings of a simulated camera: printed sheets at their true places."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from cdpr_sim_bus.errors import SimulatorError
from cdpr_sim_bus.robot.camera_plant import (
    DEFAULT_SCENE,
    BoardPlant,
    CameraPlant,
    GridPlant,
    MarkerPlant,
    PrintPlant,
)
from cdpr_sim_bus.robot.platform import rotation_of

FloatArray = NDArray[np.float64]
_TEXELS = 24
"""Texels of a texture per square of a marker."""
_MARGIN = 1
"""Squares of white paper around a marker."""
_INK, _PAPER = 0.0, 1.0


@dataclass(frozen=True)
class Sheet:
    """A printed sheet; its frame has x to the right, y up and z out of the paper."""

    name: str
    texture: NDArray[np.float32]
    """Brightness from 0 (ink) to 1 (paper), (rows, columns), top row first."""
    half_m: tuple[float, float]
    """Half of the sheet's true width and height."""
    bend_1_m: float
    """Curvature about the sheet's vertical axis."""
    position_m: FloatArray
    rotation: FloatArray
    moves_after_image: int | None = None
    moves_m: tuple[float, ...] = (0.0, 0.0, 0.0)

    def place(self, images_taken: int) -> FloatArray:
        """Return the position of the sheet's centre, (3,), for the next image."""
        if self.moves_after_image is None or images_taken < self.moves_after_image:
            return self.position_m
        return np.add(self.position_m, self.moves_m)

    def outline(self) -> FloatArray:
        """Return points on the sheet's edge, in the sheet's frame, (n, 3)."""
        x, y = self.half_m
        border = np.array([(-1, 1), (0, 1), (1, 1), (1, 0), (1, -1), (0, -1), (-1, -1), (-1, 0)])
        flat = border * (x, y)
        return np.column_stack([flat, 0.5 * self.bend_1_m * flat[:, 0] ** 2])


def build_scene(plant: CameraPlant) -> list[Sheet]:
    """Return all sheets of a plant; raises SimulatorError for markers that do not exist."""
    chance = np.random.default_rng([plant.seed, 11])
    dictionary = _dictionary(plant.dictionary)
    grids = plant.grids or (() if plant.markers or plant.board else DEFAULT_SCENE)
    placed = [one for grid in grids for one in _grid_markers(grid, chance)] + list(plant.markers)
    sheets = [_marker_sheet(one, dictionary, plant.printing, chance) for one in placed]
    if plant.board is not None:
        sheets.append(_board_sheet(plant.board))
    return sheets


def _dictionary(name: str) -> Any:
    number = getattr(cv2.aruco, f"DICT_{name}", None)
    if number is None:
        raise SimulatorError(f"dictionary {name!r}; allowed: those of OpenCV, such as 4X4_100")
    return cv2.aruco.getPredefinedDictionary(number)


def _grid_markers(grid: GridPlant, chance: np.random.Generator) -> list[MarkerPlant]:
    rotation, origin = rotation_of(np.radians(grid.rotation_deg)), np.array(grid.origin_m)
    markers = []
    for k in range(grid.rows * grid.columns):
        row, column = divmod(k, grid.columns)
        place = np.zeros(3)
        place[0] = (column - (grid.columns - 1) / 2.0) * grid.pitch_m
        place[1] = ((grid.rows - 1) / 2.0 - row) * grid.pitch_m
        place[:2] += chance.normal(0.0, grid.position_sigma_m, 2)
        place[2] = chance.normal(0.0, grid.height_sigma_m)
        tilt = chance.normal(0.0, math.radians(grid.tilt_sigma_deg), 2)
        turn = chance.normal(0.0, math.radians(grid.turn_sigma_deg))
        pose = rotation @ rotation_of((*tilt, 0.0)) @ rotation_of((0.0, 0.0, turn))
        vector, _ = cv2.Rodrigues(pose)
        markers.append(
            MarkerPlant(
                id=grid.first_id + k,
                size_m=grid.size_m,
                position_m=tuple((origin + rotation @ place).tolist()),
                rotation_deg=tuple(np.degrees(vector.ravel()).tolist()),
            )
        )
    return markers


def _marker_sheet(
    marker: MarkerPlant, dictionary: Any, printing: PrintPlant, chance: np.random.Generator
) -> Sheet:
    if marker.id >= len(dictionary.bytesList):
        raise SimulatorError(
            f"marker {marker.id}; allowed: 0 to {len(dictionary.bytesList) - 1} of this dictionary"
        )
    squares = dictionary.markerSize + 2
    bits = cv2.aruco.generateImageMarker(dictionary, marker.id, squares * _TEXELS)
    texture = np.pad(bits, _MARGIN * _TEXELS, constant_values=255).astype(np.float32) / 255.0
    if marker.mirrored:
        texture = texture[:, ::-1]
    half = marker.size_m * (squares + 2 * _MARGIN) / squares / 2.0
    wide, high = 1.0 + printing.scale_error + chance.normal(0.0, printing.scale_sigma, 2)
    bend = 2.0 * chance.normal(0.0, printing.bend_sigma_m) / half**2
    return Sheet(
        name=str(marker.id),
        texture=np.ascontiguousarray(texture),
        half_m=(half * wide, half * high),
        bend_1_m=float(bend),
        position_m=np.array(marker.position_m),
        rotation=rotation_of(np.radians(marker.rotation_deg)),
        moves_after_image=marker.moves_after_image,
        moves_m=marker.moves_m,
    )


def _board_sheet(board: BoardPlant) -> Sheet:
    made = cv2.aruco.CharucoBoard(
        (board.columns, board.rows), board.square_m, board.marker_m, _dictionary(board.dictionary)
    )
    texels = 4 * _TEXELS
    image = made.generateImage((board.columns * texels, board.rows * texels))
    texture = np.pad(image, texels // 2, constant_values=255).astype(np.float32) / 255.0
    return Sheet(
        name="board",
        texture=texture,
        half_m=(
            board.square_m * (board.columns + 1) / 2.0,
            board.square_m * (board.rows + 1) / 2.0,
        ),
        bend_1_m=0.0,
        position_m=np.array(board.position_m),
        rotation=rotation_of(np.radians(board.rotation_deg)),
    )
