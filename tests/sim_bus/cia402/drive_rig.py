"""A simulated drive without a bus. Tests exchange frames and advance the bus time."""

from __future__ import annotations

import struct
from collections.abc import Callable
from pathlib import Path

import cdpr_profiles
from cdpr_sim_bus.cia402.drive import SimDrive
from cdpr_sim_bus.robot.plant import Plant

EDS = Path(cdpr_profiles.__file__).parent / "drives" / "generic-cia402.eds"
FRAME = struct.Struct("=IB3x8s")
NODE = 5
PERIOD_S = 1e-3
SMOOTH = Plant.model_validate({"ripple": {"sixth": 0.0, "twelfth": 0.0}})
"""A motor whose torque is exactly proportional to its current."""


class SdoRefusedError(Exception):
    def __init__(self, code: int) -> None:
        super().__init__(f"{code:08X}h")
        self.code = code


class Rig:
    """The master of one drive: SDO, default PDOs, SYNC."""

    def __init__(
        self, plant: Plant | None = None, truth_log: Path | None = None, eds: Path = EDS
    ) -> None:
        self.drive = SimDrive(eds, NODE, plant or Plant(), truth_log=truth_log)
        self.now = 0.0
        self.word = 0
        self.torque = 0
        self.status = 0
        self.position = 0
        self.emergencies: list[tuple[int, int]] = []
        self.seen: list[int] = []
        self.run(0.01)

    # -- frames
    def send(self, cob_id: int, data: bytes = b"") -> list[tuple[int, bytes]]:
        self.drive.receive(FRAME.pack(cob_id, len(data), data.ljust(8, b"\0")), self.now)
        return self.collect()

    def collect(self) -> list[tuple[int, bytes]]:
        frames = []
        for frame in self.drive.outbox:
            cob_id, length, data = FRAME.unpack(frame)
            frames.append((cob_id, data[:length]))
        self.drive.outbox.clear()
        for cob_id, data in frames:
            if cob_id == 0x80 + NODE:
                self.emergencies.append(struct.unpack_from("<HB", data))
        return frames

    def read(self, index: int, sub: int = 0, *, signed: bool = False) -> int:
        ((_, data),) = self.send(0x600 + NODE, struct.pack("<BHB4x", 0x40, index, sub))
        if data[0] == 0x80:
            raise SdoRefusedError(struct.unpack_from("<I", data, 4)[0])
        size = 4 - (data[0] >> 2 & 3)
        return int.from_bytes(data[4 : 4 + size], "little", signed=signed)

    def write(self, index: int, value: int, sub: int = 0) -> None:
        size = self.drive.od.entry(index, sub).codec.size
        assert size is not None
        payload = (value & (1 << 8 * size) - 1).to_bytes(4, "little")
        command = 0x23 | 4 - size << 2
        answer = self.send(0x600 + NODE, struct.pack("<BHB", command, index, sub) + payload)
        (data,) = (data for cob_id, data in answer if cob_id == 0x580 + NODE)
        if data[0] == 0x80:
            raise SdoRefusedError(struct.unpack_from("<I", data, 4)[0])

    # -- time without SYNC
    def run(self, seconds: float) -> None:
        until = self.now + seconds
        while self.now < until - 1e-9:
            self.now = min(until, self.now + PERIOD_S)
            self.drive.advance(self.now)
            self.collect()

    # -- cyclic exchange
    def map_pdos(self) -> None:
        for communication, mapping, base, kind, entries in (
            (0x1400, 0x1600, 0x200, 1, (0x60400010, 0x60710010)),
            (0x1800, 0x1A00, 0x180, 1, (0x60410010, 0x60640020, 0x60770010)),
            (0x1801, 0x1A01, 0x280, 0, (0x60610008, 0x60B90010, 0x60BA0020)),
        ):
            cob_id = base + NODE
            self.write(communication, 0x80000000 | cob_id, 1)
            self.write(communication, kind, 2)
            self.write(mapping, 0)
            for k, entry in enumerate(entries, 1):
                self.write(mapping, entry, k)
            self.write(mapping, len(entries))
            self.write(communication, cob_id, 1)
        self.write(0x1006, round(PERIOD_S * 1e6))
        self.nmt(1)

    def nmt(self, command: int) -> None:
        self.send(0x000, bytes([command, NODE]))

    def cycle(self) -> list[tuple[int, bytes]]:
        self.send(0x200 + NODE, struct.pack("<Hh", self.word, self.torque))
        self.now += PERIOD_S
        self.drive.advance(self.now)
        frames = self.collect() + self.send(0x080)
        for cob_id, data in frames:
            if cob_id == 0x180 + NODE:
                self.status, self.position, self.actual_torque = struct.unpack("<Hih", data)
                if not self.seen or self.seen[-1] != self.status:
                    self.seen.append(self.status)
        return frames

    def cycles(self, count: int) -> None:
        for _ in range(count):
            self.cycle()

    def until(self, condition: Callable[[], bool], limit_s: float) -> None:
        for _ in range(round(limit_s / PERIOD_S)):
            if condition():
                return
            self.cycle()
        raise AssertionError(f"not within {limit_s} s: status {self.status:04X}h")

    def set_mode(self, mode: int) -> None:
        self.write(0x6060, mode)
        self.until(lambda: self.read(0x6061, signed=True) == mode, 0.1)

    def enable(self, mode: int) -> None:
        if self.drive.od.get_int(0x1400, 1) & 0x80000000 or self.drive._slave.nmt_state != 5:
            self.map_pdos()
        self.set_mode(mode)
        for word, mask, value in ((6, 0x6F, 0x21), (7, 0x6F, 0x23), (15, 0x6F, 0x27)):
            self.word = word
            self.until(lambda mask=mask, value=value: self.status & mask == value, 0.2)

    @property
    def state(self) -> int:
        status = self.read(0x6041)
        for mask in (0x6F, 0x4F):
            if status & mask in STATES[mask]:
                return status & mask
        raise AssertionError(f"no such state: {status:04X}h")

    @property
    def truth(self) -> tuple[float, float]:
        sample = self.drive.axis.sample
        return sample[4], sample[5]


STATES = {0x6F: {0x21, 0x23, 0x27, 0x07}, 0x4F: {0x00, 0x40, 0x0F, 0x08}}
