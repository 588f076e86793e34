"""Explains what a robot's drives report, for the daemon's service."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from typing import Any

from cdpr_profiles import Robot, load_robot
from cdpr_profiles.errors import ProfileError
from cdpr_profiles.robot import RobotAxis
from cdpr_rt.service.service import DriveTextsError


class RobotDriveTexts:
    """Explains statuswords and objects of the drives of a robot's file.

    The decoder and the file are loaded when they are first needed.
    """

    def __init__(self, robot: str) -> None:
        self._path = robot

    @cached_property
    def _robot(self) -> Robot:
        try:
            return load_robot(self._path)
        except ProfileError as error:
            raise DriveTextsError(
                f"{error}; the robot still runs with the file as it was at its start; correct the "
                "file"
            ) from None

    def drives(self, statuswords: Sequence[int]) -> list[dict[str, Any]]:
        """Return for each axis what its statusword means, as `models.Drive`."""
        pairs = zip(self._robot.axes, statuswords, strict=False)
        return [_drive(axis, word) for axis, word in pairs]

    def buses(self) -> list[dict[str, Any]]:
        """Return the planned load of each bus, as `models.Bus`."""
        from cdpr_drivers.bus.budget import machine_budget  # noqa: PLC0415

        return [
            {
                "name": one.bus,
                "load": one.cycle_s / one.period_s + one.heartbeat_share,
                "bitrate_bit_s": one.bitrate_bit_s,
            }
            for one in machine_budget(self._robot)
        ]

    def object(self, axis: int, index: int, sub: int, data: bytes) -> dict[str, Any]:
        """Return the meaning of an object's data, as `models.DriveObject`."""
        from cdpr_drivers.decode.values import NodeView, ObjectNames, read_field  # noqa: PLC0415

        if axis >= len(self._robot.axes):
            raise DriveTextsError(
                f"{self._path}: has no axis {axis} any more; start the robot again"
            )
        of = self._robot.axes[axis]
        winch = of.winch
        view = NodeView(of.node_id, ObjectNames(winch.drive.eds), winch.drive)
        view.rated_torque_Nm = winch.motor.rated_torque_Nm
        view.counts_per_turn = winch.encoder_counts_per_turn
        found = read_field(view, index, sub, data)
        return {"name": found.name, "text": found.text, "raw": data.hex(" ")}


def _drive(axis: RobotAxis, word: int) -> dict[str, Any]:
    from cdpr_drivers.cia402 import mode_name  # noqa: PLC0415
    from cdpr_drivers.decode.values import STATUSWORD_BITS, statusword_text  # noqa: PLC0415

    mode = axis.winch.drive.mode_torque
    bits = [
        {"bit": bit, "name": name, "on": bool(word >> bit & 1)}
        for bit, name in enumerate(STATUSWORD_BITS)
    ]
    return {
        "name": axis.name, "bus": axis.bus, "node_id": axis.node_id,
        "drive": axis.winch.drive.name, "mode": mode_name(mode), "bits": bits,
        "state": statusword_text(word, mode),
    }  # fmt: skip
