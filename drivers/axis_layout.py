"""Where each axis' values lie in the frames of a group, and what one unit of them means."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from drivers import axis_codec as codec
from drivers.boot import BootReport
from drivers.bus import FrameBuffer
from drivers.errors import DriverError
from profiles import DriveProfile, Pdo

_EMCY, _HEARTBEAT = 0x080, 0x700
_TPDO_FIELDS = {
    0x6041: codec.STATUSWORD,
    0x6064: codec.RAW_POSITION,
    0x6077: codec.TORQUE_UNITS,
    0x6061: codec.MODE_SHOWN,
    0x60B9: codec.PROBE_STATUS,
    0x60BA: codec.PROBE_POSITION,
}
_EVERY_CYCLE = (0x6041, 0x6064, 0x6077)
_UNSIGNED = (0x6041, 0x60B9)
_RPDO_FIELDS = {0x6040: codec.CONTROLWORD, 0x6071: codec.TARGET_TORQUE}
_UNITS_PER_RATED_TORQUE = {"per_mille_of_rated": 1000}


@dataclass(frozen=True)
class AxisConfig:
    """One axis of a group, with what its drive said of itself while it booted."""

    node_id: int
    drive: DriveProfile
    rated_torque_Nm: float
    """6076h: what the drive's torque unit refers to."""
    counts_per_turn: int
    """608Fh."""
    supported_modes: int
    """6502h."""
    torque_limit_Nm: float

    @classmethod
    def from_boot(
        cls, drive: DriveProfile, report: BootReport, torque_limit_Nm: float
    ) -> AxisConfig:
        """Return the axis of a drive that has booted."""
        return cls(
            report.node_id,
            drive,
            report.rated_torque_Nm,
            report.counts_per_turn,
            report.supported_modes,
            torque_limit_Nm,
        )

    @property
    def rad_per_count(self) -> float:
        """Motor angle of one count of 6064h, with the drive's sign."""
        return self.drive.position_sign * math.tau / self.counts_per_turn

    @property
    def Nm_per_unit(self) -> float:
        """Motor torque of one unit of 6071h and 6077h, with the drive's sign."""
        units = _UNITS_PER_RATED_TORQUE[self.drive.torque_unit]
        return self.drive.torque_sign * self.rated_torque_Nm / units


class GroupLayout:
    """The frames of n axes, as the tables that the compiled kernels work on.

    Raises DriverError for a profile whose PDO map does not serve torque control.
    """

    def __init__(self, axes: Sequence[AxisConfig]) -> None:
        self.slots: NDArray[np.int64] = np.full((2048, 2), -1, np.int64)
        """Axis and kind (TPDO number in the profile, EMCY, HEARTBEAT) by identifier."""
        self.fields: NDArray[np.int64] = np.zeros((len(axes), codec.MAX_FIELDS, 5), np.int64)
        """By axis: TPDO, target row, first byte, bytes, signed; 0 bytes end the list."""
        self.answer: NDArray[np.int64] = np.zeros((len(axes), 2), np.int64)
        """By axis: first byte of controlword and of target torque."""
        self.rpdos = FrameBuffer(len(axes))
        """The RPDO of each axis, to be filled and sent each cycle."""
        self.mode_mapped = np.zeros(len(axes), np.bool_)
        self.probe_mapped = np.zeros(len(axes), np.bool_)
        for i, axis in enumerate(axes):
            self._place_feedback(i, axis)
            self._place_command(i, axis)

    @property
    def identifiers(self) -> list[int]:
        """Identifiers of the frames that the cycle takes in."""
        return [int(i) for i in np.flatnonzero(self.slots[:, 0] >= 0)]

    def _place_feedback(self, i: int, axis: AxisConfig) -> None:
        self._claim(_EMCY + axis.node_id, i, codec.EMCY)
        self._claim(_HEARTBEAT + axis.node_id, i, codec.HEARTBEAT)
        pdo_of: dict[int, int] = {}
        row = 0
        for number, pdo in enumerate(axis.drive.tpdos):
            self._claim(pdo.cob_id(axis.node_id), i, number)
            for index, start, size in _places(pdo):
                if index not in _TPDO_FIELDS or index in pdo_of:
                    continue
                pdo_of[index] = number
                signed = int(index not in _UNSIGNED)
                self.fields[i, row] = number, _TPDO_FIELDS[index], start, size, signed
                row += 1
        if len({pdo_of.get(index) for index in _EVERY_CYCLE}) != 1 or 0x6041 not in pdo_of:
            raise DriverError(
                f"drive profile {axis.drive.name!r}: tpdos: no single TPDO holds 6041h, 6064h and "
                "6077h, which torque control needs of one instant"
            )
        self.mode_mapped[i] = 0x6061 in pdo_of
        self.probe_mapped[i] = 0x60B9 in pdo_of and pdo_of[0x60B9] == pdo_of.get(0x60BA)

    def _claim(self, identifier: int, axis: int, kind: int) -> None:
        if self.slots[identifier, 0] >= 0:
            raise DriverError(
                f"two messages of the group have the identifier {identifier:03X}h: two axes with "
                "one node id, or cob_id_offset of a PDO meets another message"
            )
        self.slots[identifier] = axis, kind

    def _place_command(self, i: int, axis: AxisConfig) -> None:
        for pdo in axis.drive.rpdos:
            places = {index: (start, size) for index, start, size in _places(pdo)}
            if all(places.get(index, (0, 0))[1] == 2 for index in _RPDO_FIELDS):
                for index, column in _RPDO_FIELDS.items():
                    self.answer[i, column] = places[index][0]
                frame = self.rpdos.array[i]
                frame["can_id"] = pdo.cob_id(axis.node_id)
                frame["length"] = sum(entry.bits for entry in pdo.entries) // 8
                return
        raise DriverError(
            f"drive profile {axis.drive.name!r}: rpdos: no RPDO holds 6040h and 6071h with 16 bits "
            "each, which torque control needs"
        )


def _places(pdo: Pdo) -> Iterator[tuple[int, int, int]]:
    """Yield object index, first byte and number of bytes of what a PDO maps."""
    start = 0
    for entry in pdo.entries:
        yield entry.index, start, entry.bits // 8
        start += entry.bits // 8
