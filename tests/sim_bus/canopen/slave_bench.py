"""A slave without a bus. Tests give it frames and bus time directly."""

from __future__ import annotations

import functools
import math
import struct
from pathlib import Path

import canopen

from cdpr_sim_bus.canopen import CanopenSlave, NmtState, ObjectDictionary, ParameterStore
from cdpr_sim_bus.canopen.slave import SlaveApplication

ROOT = Path(__file__).parents[3]
GENERIC_EDS = ROOT / "profiles" / "drives" / "generic-cia402.eds"
NODE = 5
MASTER = 127
FRAME = struct.Struct("<IB3x8s")
RTR = 0x40000000

ODD_OBJECTS = {
    0x2100: ("0x0016", "rw", "0x123456"),
    0x2101: ("0x001B", "rw", "0"),
    0x2102: ("0x0011", "rw", "0.5"),
    0x2103: ("0x000B", "rw", "text"),
    0x2104: ("0x000A", "rw", "0102"),
    0x2105: ("0x0009", "rw", "name"),
    0x2106: ("0x0005", "wo", "7"),
    0x2107: ("0x0014", "rw", "0"),
    0x2108: ("0x0001", "rw", "1"),
    0x2109: ("0x0007", "ro", "0xCAFE"),
}
"""Types and access rights that a usual drive does not use: (data type, access, default)."""


def odd_eds(directory: Path) -> Path:
    """Write an EDS of the generic drive with dummies allowed and objects of each type added."""
    text = GENERIC_EDS.read_text()
    for n in range(2, 8):
        text = text.replace(f"Dummy000{n}=0", f"Dummy000{n}=1")
    for index, (data_type, access, default) in ODD_OBJECTS.items():
        text += (
            f"\n[{index:04X}]\nParameterName=Odd {index:04X}\nObjectType=0x7\n"
            f"DataType={data_type}\nAccessType={access}\nDefaultValue={default}\nPDOMapping=1\n"
        )
    path = directory / "odd.eds"
    path.write_text(text)
    return path


@functools.cache
def _parsed(eds: Path) -> canopen.ObjectDictionary:
    return canopen.import_od(str(eds))


class Recorder(SlaveApplication):
    """An application that records its callbacks."""

    def __init__(self) -> None:
        self.events: list[tuple[object, ...]] = []

    def before_sync(self, now: float) -> None:
        self.events.append(("before_sync", now))

    def after_rpdo(self, now: float) -> None:
        self.events.append(("after_rpdo", now))

    def on_nmt(self, state: NmtState) -> None:
        self.events.append(("nmt", state))

    def on_reset_node(self) -> None:
        self.events.append(("reset",))

    def on_heartbeat_lost(self, node: int) -> None:
        self.events.append(("heartbeat_lost", node))

    def on_rpdo_timeout(self, number: int) -> None:
        self.events.append(("rpdo_timeout", number))


class Bench:
    """One slave, the frames it sent in their order, and the bus time."""

    def __init__(
        self,
        eds: Path = GENERIC_EDS,
        node_id: int = NODE,
        store: ParameterStore | None = None,
        app: SlaveApplication | None = None,
        bitrate: int = 1_000_000,
    ) -> None:
        self.od = ObjectDictionary.from_eds(eds, node_id)
        # the factory setting suits any master; this one suits a synchronous master
        self.od.set_default(0x1400, 2, 1)
        self.od.set_default(0x1801, 2, 0)
        self.app = Recorder() if app is None else app
        self.slave = CanopenSlave(self.od, node_id, self.app, store=store, bitrate=bitrate)
        self.now = 0.0
        self.network = DirectNetwork(self)
        self.remote = self.network.add_node(node_id, _parsed(eds)) if node_id < 128 else None

    def boot(self) -> Bench:
        self.slave.advance(self.now)
        self.take()
        return self

    def take(self) -> list[tuple[int, bytes]]:
        """Return identifier and data of the frames sent since the last call."""
        frames = []
        for packed in self.slave.outbox:
            assert len(packed) == 16
            identifier, length, data = FRAME.unpack(packed)
            frames.append((identifier, data[:length]))
        self.slave.outbox.clear()
        return frames

    def send(self, identifier: int, data: bytes = b"") -> list[tuple[int, bytes]]:
        """Deliver a frame. Return the frames that the slave sent."""
        self.slave.receive(FRAME.pack(identifier, len(data), data), self.now)
        return self.take()

    def run_to(self, time_s: float) -> list[tuple[float, int, bytes]]:
        """Advance bus time as the hub does. Return (time, identifier, data) of the sent frames."""
        sent = []
        while (due := self.slave.next_event()) <= time_s:
            self.now = max(self.now, due)
            self.slave.advance(self.now)
            assert self.slave.next_event() > self.now or math.isinf(due)
            sent += [(self.now, *frame) for frame in self.take()]
        self.now = time_s
        self.slave.advance(time_s)
        return sent + [(self.now, *frame) for frame in self.take()]

    def sync(self, data: bytes = b"", period_s: float = 1e-3) -> list[tuple[int, bytes]]:
        """Send a SYNC one period after the last."""
        self.now += period_s
        self.slave.advance(self.now)
        return self.take() + self.send(0x80, data)

    def nmt(self, command: int, node: int = NODE) -> list[tuple[int, bytes]]:
        return self.send(0, bytes([command, node]))

    def start(self) -> Bench:
        self.nmt(1)
        return self

    def sdo(self, request: bytes) -> bytes:
        """Return the answer of the SDO server to one request."""
        ((identifier, data),) = self.send(0x600 + self.slave.node_id, request.ljust(8, b"\0"))
        assert identifier == 0x580 + self.slave.node_id
        assert len(data) == 8
        return data

    def write(self, index: int, sub: int, data: bytes) -> None:
        """Write by SDO with the `canopen` package, which may raise canopen.SdoAbortedError."""
        assert self.remote is not None
        self.remote.sdo.download(index, sub, data)

    def read(self, index: int, sub: int = 0) -> bytes:
        assert self.remote is not None
        return self.remote.sdo.upload(index, sub)

    def configure_pdo(self, com: int, entries: list[int], transmission: int, **extra: int) -> None:
        """Map and enable a PDO by the standard's procedure. `extra` are sub3, sub5 and sub6."""
        cob_id = int.from_bytes(self.read(com, 1), "little")
        off = (cob_id | 0x80000000).to_bytes(4, "little")
        self.write(com, 1, off)
        self.write(com, 2, bytes([transmission]))
        for name, value in extra.items():
            sub = int(name[3:])
            self.write(com, sub, value.to_bytes(1 if sub == 6 else 2, "little"))
        mapping = com + 0x200
        self.write(mapping, 0, b"\0")
        for sub, entry in enumerate(entries, 1):
            self.write(mapping, sub, entry.to_bytes(4, "little"))
        self.write(mapping, 0, bytes([len(entries)]))
        self.write(com, 1, (cob_id & 0x7FFFFFFF).to_bytes(4, "little"))
        self.take()


class DirectNetwork(canopen.Network):
    """The master of the `canopen` package, connected to the bench without sockets."""

    def __init__(self, bench: Bench) -> None:
        super().__init__()
        self._bench = bench
        self.drop_to_slave: set[int] = set()
        self.drop_to_master: set[int] = set()
        self.frames_to_slave = 0
        self.frames_to_master = 0

    def send_message(self, can_id: int, data: bytes, remote: bool = False) -> None:
        """Deliver a frame, then the answers. Frames whose number is in `drop` are lost."""
        self.frames_to_slave += 1
        if self.frames_to_slave in self.drop_to_slave:
            return
        for identifier, answer in self._bench.send(can_id | (RTR if remote else 0), bytes(data)):
            self.frames_to_master += 1
            if self.frames_to_master not in self.drop_to_master:
                self.notify(identifier, bytearray(answer), self._bench.now)
