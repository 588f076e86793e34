"""Publishes where a robot's platform truly is on the physics board, for what it carries."""

from __future__ import annotations

import numpy as np

from cdpr_sim_bus.physics_board import BoardPlatform, PlatformState
from cdpr_sim_bus.robot.cable_robot import CableRobot


class BoardPose:
    """A log that keeps the newest pose only, on the board; that of power-up at first."""

    def __init__(self, robot: CableRobot, board: BoardPlatform) -> None:
        self._robot, self._board = robot, board
        self.append(0, 0.0, ())

    def append(self, _sync_index: int, time_s: float, _truth: tuple[float, ...]) -> None:
        """Publish pose and motion of the platform's frame as they are now."""
        p, robot = self._robot.platform[0], self._robot
        lever = np.cross(p["spin"], p["rotation"] @ p["com"])
        self._board.publish(
            PlatformState(
                time_s,
                tuple(robot.position_m.tolist()),
                tuple(robot.rotation.ravel().tolist()),
                tuple((p["velocity"] - lever).tolist()),
                tuple(p["spin"].tolist()),
            )
        )

    def flush(self) -> None:
        """Do nothing: nothing waits."""

    def close(self) -> None:
        """Do nothing: the board is its owner's to close."""
