"""Layout of a group's frames: positions of each axis' values, and their units in SI."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from cdpr_drivers.axes import axis_codec as codec
from cdpr_drivers.bus import FrameBuffer
from cdpr_drivers.canopen.boot import BootReport
from cdpr_drivers.drive_units import acceleration_unit_rad_s2, torque_unit_Nm, velocity_unit_rad_s
from cdpr_drivers.errors import DriverError
from cdpr_profiles import DriveProfile, Pdo

_EMCY, _HEARTBEAT = 0x080, 0x700
_TPDO_FIELDS = {
    0x6041: codec.STATUSWORD,
    0x6064: codec.RAW_POSITION,
    0x6077: codec.TORQUE_UNITS,
    0x6061: codec.MODE_DISPLAYED,
    0x60B9: codec.PROBE_STATUS,
    0x60BA: codec.PROBE_POSITION,
}
_BYTES = {0x6041: (2,), 0x6064: (4,), 0x6077: (2, 4), 0x6061: (1,), 0x60B9: (2,), 0x60BA: (4,)}
_COMMAND_BYTES = {0x6040: (2,), 0x6071: (2, 4)}
_EVERY_CYCLE = (0x6041, 0x6064, 0x6077)
_UNSIGNED = (0x6041, 0x60B9)
_RPDO_FIELDS = {
    0x6040: (codec.CONTROLWORD_FRAME, codec.CONTROLWORD),
    0x6071: (codec.TORQUE_FRAME, codec.TARGET_TORQUE),
}
_EVERY_SYNC = 1
_OBJECTS = 0x1000
"""First index that is not a data type; data types are mapped as dummies (CiA 301)."""


@dataclass(frozen=True)
class AxisConfig:
    """One axis of a group, with the ratings that its drive reported at boot."""

    node_id: int
    drive: DriveProfile
    rated_torque_Nm: float
    """6076h: the reference of a relative torque unit."""
    counts_per_turn: int
    """608Fh, or the winch's value if the drive has none."""
    supported_modes: int
    """6502h; the profile's modes if the drive has no 6502h."""
    torque_limit_Nm: float
    torque_constant_Nm_per_Arms: float = 0.0
    """Of the motor: the reference of a torque unit that is a current."""
    name: str = ""
    """Name for messages, next to the node id; may be empty."""

    @classmethod
    def from_boot(
        cls, drive: DriveProfile, report: BootReport, torque_limit_Nm: float, name: str = ""
    ) -> AxisConfig:
        """Return the axis of a drive that has booted."""
        return cls(
            report.node_id,
            drive,
            report.rated_torque_Nm,
            report.counts_per_turn,
            report.supported_modes,
            torque_limit_Nm,
            report.torque_constant_Nm_per_Arms,
            name,
        )

    @property
    def label(self) -> str:
        """Node id, with the name in brackets, for messages."""
        return f"node {self.node_id}" + (f" ({self.name})" if self.name else "")

    @property
    def rad_per_count(self) -> float:
        """Motor angle of one count of 6064h, with the drive's sign."""
        return self.drive.position_sign * math.tau / self.counts_per_turn

    @property
    def Nm_per_unit(self) -> float:
        """Motor torque of one unit of 6071h and 6077h, with the drive's sign."""
        constant = self.torque_constant_Nm_per_Arms
        return self.drive.torque_sign * torque_unit_Nm(self.drive, self.rated_torque_Nm, constant)

    @property
    def most_torque_units(self) -> int:
        """Largest value of 6071h: 15 bits allow at most 32.767 Nm if the unit is mNm."""
        entries = (entry for pdo in self.drive.rpdos for entry in pdo.entries)
        return max(1 << entry.bits - 1 for entry in entries if entry.index == 0x6071) - 1

    def speed_units(self, speed_rad_s: float) -> int:
        """Return a speed in units of 6099h, at least one."""
        unit = velocity_unit_rad_s(self.drive, self.counts_per_turn)
        return max(1, round(speed_rad_s / unit))

    def acceleration_units(self, acceleration_rad_s2: float) -> int:
        """Return an acceleration in units of 609Ah, at least one."""
        unit = acceleration_unit_rad_s2(self.drive, self.counts_per_turn)
        return max(1, round(acceleration_rad_s2 / unit))

    @property
    def expected_tpdos(self) -> int:
        """The TPDOs that form the answer to a SYNC, as bits by their place in the profile."""
        return sum({1 << pdo for pdo in _feedback_tpdos(self.drive).values()})


class GroupLayout:
    """The frames of n axes, as the tables that the compiled kernels use.

    Raises DriverError for a profile whose PDO map does not support torque control.
    """

    def __init__(self, axes: Sequence[AxisConfig]) -> None:
        self.slots: NDArray[np.int64] = np.full((2048, 2), -1, np.int64)
        """Axis and kind (TPDO number in the profile, EMCY, HEARTBEAT) by identifier."""
        self.fields: NDArray[np.int64] = np.zeros((len(axes), codec.MAX_FIELDS, 5), np.int64)
        """By axis, a list of fields: TPDO, target row, first byte, size, signed; size 0 ends it."""
        self.command_offsets: NDArray[np.int64] = np.zeros((len(axes), 5), np.int64)
        """By axis: row in `rpdos` and first byte of the controlword, the same of the target torque,
        and the torque's number of bytes."""
        commands = [_command_rpdos(axis.drive) for axis in axes]
        self.rpdos = FrameBuffer(sum(len(pdos) for pdos in commands))
        """The RPDOs of all axes, to be filled and sent each cycle."""
        self.mode_mapped = np.zeros(len(axes), np.bool_)
        self.probe_mapped = np.zeros(len(axes), np.bool_)
        first = 0
        for i, axis in enumerate(axes):
            self._place_feedback(i, axis)
            self._place_command(i, axis, commands[i], first)
            first += len(commands[i])

    @property
    def identifiers(self) -> list[int]:
        """Identifiers of the frames that the cycle receives."""
        return [int(i) for i in np.flatnonzero(self.slots[:, 0] >= 0)]

    def _place_feedback(self, i: int, axis: AxisConfig) -> None:
        self._claim(_EMCY + axis.node_id, i, codec.EMCY)
        self._claim(_HEARTBEAT + axis.node_id, i, codec.HEARTBEAT)
        pdo_of = _feedback_tpdos(axis.drive)
        row = 0
        for number, pdo in enumerate(axis.drive.tpdos):
            self._claim(pdo.cob_id(axis.node_id), i, number)
            for index, start, size in _places(pdo):
                quantity = _TPDO_FIELDS.get(index)
                if quantity is None or number != pdo_of.get(index, number):
                    continue
                if size not in _BYTES[index]:
                    allowed = " or ".join(str(8 * one) for one in _BYTES[index])
                    raise DriverError(
                        f"drive profile {axis.drive.name!r}: tpdos: {index:04X}h has {8 * size} "
                        f"bits; allowed: {allowed}"
                    )
                if quantity in self.fields[i, :row, 1]:
                    continue
                pdo_of[index] = number
                signed = int(index not in _UNSIGNED)
                self.fields[i, row] = number, quantity, start, size, signed
                row += 1
        self.mode_mapped[i] = 0x6061 in pdo_of
        self.probe_mapped[i] = 0x60B9 in pdo_of and pdo_of[0x60B9] == pdo_of.get(0x60BA)

    def _claim(self, identifier: int, axis: int, kind: int) -> None:
        if self.slots[identifier, 0] >= 0:
            raise DriverError(
                f"two messages of the group have the identifier {identifier:03X}h: two axes with "
                "one node id, or cob_id_offset of a PDO meets another message"
            )
        self.slots[identifier] = axis, kind

    def _place_command(self, i: int, axis: AxisConfig, pdos: Sequence[Pdo], first: int) -> None:
        for row, pdo in enumerate(pdos, first):
            frame = self.rpdos.array[row]
            frame["can_id"] = pdo.cob_id(axis.node_id)
            frame["length"] = sum(entry.bits for entry in pdo.entries) // 8
            for index, start, size in _places(pdo):
                if index == 0x6071:
                    self.command_offsets[i, codec.TORQUE_BYTES] = size
                if index in _RPDO_FIELDS:
                    frame_column, byte_column = _RPDO_FIELDS[index]
                    self.command_offsets[i, frame_column], self.command_offsets[i, byte_column] = (
                        row,
                        start,
                    )


def _feedback_tpdos(drive: DriveProfile) -> dict[int, int]:
    """Return for each object the TPDO that carries it after every SYNC, by place in the profile."""
    found: dict[int, int] = {}
    for index in _EVERY_CYCLE:
        for number, pdo in enumerate(drive.tpdos):
            every = pdo.transmission_type == _EVERY_SYNC
            if every and any(entry.index == index for entry in pdo.entries):
                found.setdefault(index, number)
        if index not in found:
            raise DriverError(
                f"drive profile {drive.name!r}: tpdos: no TPDO of transmission_type 1 contains "
                f"{index:04X}h, which torque control needs in every cycle"
            )
    return found


def _command_rpdos(drive: DriveProfile) -> list[Pdo]:
    """Return the RPDOs that carry controlword and target torque, and nothing else but gaps.

    Any other object in them, such as mode of operation or torque limit, would be set to 0 each
    cycle.
    """
    found: dict[int, Pdo] = {}
    for index in _RPDO_FIELDS:
        for pdo in drive.rpdos:
            if any(index == i and size in _COMMAND_BYTES[i] for i, _, size in _places(pdo)):
                found[index] = pdo
        if index not in found:
            raise DriverError(
                f"drive profile {drive.name!r}: rpdos: no RPDO contains {index:04X}h with 16 bits "
                "(6071h: 16 or 32), which torque control needs"
            )
    pdos = [pdo for pdo in drive.rpdos if pdo in found.values()]
    for index in (entry.index for pdo in pdos for entry in pdo.entries):
        if index not in _RPDO_FIELDS and index >= _OBJECTS:
            raise DriverError(
                f"drive profile {drive.name!r}: rpdos: {index:04X}h is in an RPDO that is sent "
                "every cycle, and would be set to 0; allowed: 6040h, 6071h and dummies"
            )
    return pdos


def _places(pdo: Pdo) -> Iterator[tuple[int, int, int]]:
    """Yield object index, first byte and number of bytes of each object that a PDO maps."""
    start = 0
    for entry in pdo.entries:
        yield entry.index, start, entry.bits // 8
        start += entry.bits // 8
