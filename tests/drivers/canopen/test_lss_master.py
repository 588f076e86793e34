"""The LSS master with simulated devices on a bus, compared with a third party's master."""

from __future__ import annotations

import os
import random
import threading
import time
from collections.abc import Iterator
from contextlib import ExitStack, closing, contextmanager
from pathlib import Path

import can
import canopen
import pytest

from cdpr_drivers.bus import BusUrl
from cdpr_drivers.bus.simbus import open_clock
from cdpr_drivers.canopen.lss import UNCONFIGURED, LssAddress, LssError, LssMaster
from cdpr_drivers.errors import SdoAbortError, SdoTimeoutError
from cdpr_profiles import load_drive
from cdpr_rt.core.clock import PacedClock
from cdpr_sim_bus.bus.hub import Hub
from cdpr_sim_bus.canopen import CanopenSlave, ObjectDictionary, ParameterStore, SlaveApplication

pytestmark = pytest.mark.alone

EDS = load_drive("generic-cia402").eds
VENDOR, PRODUCT, REVISION = 0x00CD9A01, 0x402, 0x10000
TIMEOUT_S = 0.02


@pytest.fixture(autouse=True)
def quick(monkeypatch: pytest.MonkeyPatch) -> None:
    """Shorten the wait for the last answer: devices in one process answer together."""
    monkeypatch.setattr("cdpr_drivers.canopen.lss._SETTLE_S", 0.001)


def device(
    serial: int,
    node_id: int = UNCONFIGURED,
    store: Path | None = None,
    product: int = PRODUCT,
    *,
    hides_others: bool = False,
) -> CanopenSlave:
    od = ObjectDictionary.from_eds(EDS, node_id)
    od.set_default(0x1018, 2, product)
    od.set_default(0x1018, 4, serial)
    return CanopenSlave(
        od, node_id, SlaveApplication(), store=ParameterStore(store), lss_hides_others=hides_others
    )


def address(serial: int, product: int = PRODUCT) -> LssAddress:
    return LssAddress(VENDOR, product, REVISION, serial)


@contextmanager
def bus_with(*nodes: CanopenSlave) -> Iterator[str]:
    name = f"lss-{os.getpid()}-{random.randrange(1 << 30)}"
    hub = Hub(nodes, name=name)
    hub.listen()
    thread = threading.Thread(target=hub.run)
    thread.start()
    try:
        yield name
    finally:
        hub.stop()
        thread.join()
        hub.close()


@contextmanager
def master_on(name: str, timeout_s: float = TIMEOUT_S, *, lead: bool = True) -> Iterator[LssMaster]:
    """Yield an LSS master. Without `lead` it uses the wall clock, so that others can answer."""
    url = BusUrl.parse(f"simbus:{name}")
    with (
        closing(open_clock([url]) if lead else PacedClock()) as clock,
        LssMaster(url, clock, timeout_s) as master,
    ):
        yield master


@contextmanager
def master_of(*nodes: CanopenSlave) -> Iterator[LssMaster]:
    with bus_with(*nodes) as name, master_on(name) as master:
        yield master


def test_fastscan_finds_all_unconfigured_devices_and_no_others() -> None:
    serials = (1, 0xFFFF0000)
    nodes = [device(serial) for serial in serials]
    with master_of(*nodes, device(77, node_id=4)) as master:
        assert master.has_unconfigured()
        wanted = [address(serial) for serial in serials]
        assert master.unconfigured() == wanted
        assert master.unconfigured() == wanted  # a search does not change the devices


def test_devices_that_hide_others_once_found_are_found_one_after_the_other() -> None:
    serials = (3, 5, 9)
    nodes = [device(serial, hides_others=True) for serial in serials]
    with master_of(*nodes) as master:
        for node_id, serial in enumerate(serials, 1):
            assert master.unconfigured() == [address(serial)]
            assert master.hides_others
            master.select(address(serial))
            master.set_node_id(node_id)
            master.release()
            assert master.wait_for_boot_up(node_id)
        assert master.unconfigured() == []
        assert not master.hides_others


def test_devices_found_before_one_that_hides_others_are_listed_with_it() -> None:
    with master_of(device(7, hides_others=True), device(2), device(9)) as master:
        assert master.unconfigured() == [address(2), address(7)]
        assert master.hides_others


def test_searching_for_missing_devices_finds_nothing() -> None:
    with master_of(device(1, node_id=3)) as master:
        assert not master.has_unconfigured()
        assert master.unconfigured() == []
        assert master.find(VENDOR, 1) == []
        with pytest.raises(LssError, match="no device answers to vendor 00CD9A01h"):
            master.select(address(2))


def test_devices_of_a_product_are_found_with_and_without_node_id() -> None:
    nodes = [device(1, 9), device(0xFFFF0000), device(7, product=1)]
    with master_of(*nodes) as master:
        low = (REVISION - 5, REVISION + 5)
        assert master.find(VENDOR, PRODUCT, low) == [address(1), address(0xFFFF0000)]
        one = (1, 1)
        assert master.find(VENDOR, PRODUCT, serials=one, usual_revision=REVISION) == [address(1)]
        assert master.find(VENDOR, PRODUCT, (0x10000, 0x10003), one) == [address(1)]
        assert master.find(VENDOR, PRODUCT, (0, 0xFFFF), one) == []
        assert [master.select(address(serial)) for serial in (1, 0xFFFF0000)] == [9, UNCONFIGURED]


def test_a_new_device_gets_its_node_id_boots_and_keeps_it(tmp_path: Path) -> None:
    path = tmp_path / "drive.json"
    with master_of(device(6), device(7, store=path)) as master:
        assert master.node_id_in_use(5, 0.05) == ""
        assert master.select(address(7)) == UNCONFIGURED
        master.set_node_id(5)
        master.store()
        master.release()
        assert master.wait_for_boot_up(5)
        assert master.node_id_in_use(5) == "it answers SDO requests"
        assert master.read_object(5, 0x1000) == 0x00020192
        with pytest.raises(SdoAbortError, match="object does not exist"):
            master.read_object(5, 0x2345)
        with pytest.raises(SdoTimeoutError):
            master.read_object(6, 0x1000)
        assert master.unconfigured() == [address(6)]
    with master_of(device(7, store=path)) as master:
        assert master.node_id_in_use(5) == "it answers SDO requests"


def test_a_node_id_in_use_by_a_stopped_node_is_detected_by_heartbeat() -> None:
    node = device(1, node_id=9)
    with bus_with(node) as name, master_on(name, lead=False) as master:
        with canopen.Network() as network:
            network.connect(interface="simbus", channel=name)
            network.add_node(9, str(EDS)).sdo[0x1017].raw = 100
            network.send_message(0, bytes([2, 9]))  # stopped: it does not answer SDO
            time.sleep(0.05)
        assert master.node_id_in_use(9) == "its heartbeat is on the bus"


def test_rejections_by_a_device_are_reported_as_text(tmp_path: Path) -> None:
    with master_of(device(1, 4, store=tmp_path / "missing" / "drive.json")) as master:
        master.select(address(1))
        with pytest.raises(
            LssError, match="rejects node id 128: it accepts only node ids 1 to 127"
        ):
            master.set_node_id(128)
        with pytest.raises(LssError, match="to store its settings: its memory could not be"):
            master.store()


def test_a_rejected_bit_rate_is_reported() -> None:
    node = device(1, 4)
    node.od.bitrates = frozenset({1_000_000, 500_000})
    with master_of(node) as master:
        master.select(address(1))
        with pytest.raises(LssError, match="bit rate of 20 kbit/s: it does not support"):
            master.set_bitrate(20_000)
        master.set_bitrate(500_000)
        master.activate_bitrate(0.02)
        time.sleep(0.1)
        assert master.node_id_in_use(4, 0.0) == ""
        assert (node.bitrate, node.muted) == (500_000, True)


def test_select_only_accepts_one_device_and_rejects_two() -> None:
    with master_of(device(1, 4)) as master:
        assert master.select_only() == (address(1), 4)
    with (
        master_of(device(1, 4), device(2)) as master,
        pytest.raises(LssError, match="2 devices answer: connect"),
    ):
        master.select_only()


class Sluggish:
    """Answer the fastscan like a device, but late, when the next request has been sent."""

    def __init__(self, name: str, numbers: tuple[int, ...], delay_s: float) -> None:
        self.bus = can.Bus(interface="simbus", channel=name)
        self.numbers, self.delay_s = numbers, delay_s
        self.position, self.found = 0, False
        self.selection: list[int] = []
        self.timers: list[threading.Timer] = []

    def serve(self, stop: threading.Event) -> None:
        while not stop.is_set():
            message = self.bus.recv(0.05)
            if message is not None and message.arbitration_id == 0x7E5:
                self.take(bytes(message.data))
        for timer in self.timers:
            timer.join()
        self.bus.shutdown()

    def take(self, data: bytes) -> None:
        if data[:2] == b"\x04\x00":
            self.found = False
        elif 0x40 <= data[0] <= 0x43:
            self.selection = [*self.selection[-3:], int.from_bytes(data[1:5], "little")]
            if data[0] == 0x43 and self.selection == list(self.numbers):
                self.found = True
                self.answer(b"\x44")
        elif data[0] == 0x5E and self.found:
            self.answer(b"\x5e\xff")
        elif data[0] == 0x51 and not self.found:
            number, bit, part, following = int.from_bytes(data[1:5], "little"), *data[5:]
            if bit == 128:
                self.position = 0
            elif part != self.position or (number ^ self.numbers[part]) >> bit:
                return
            elif bit == 0:
                self.position, self.found = following, following < part
            self.answer(b"\x4f")

    def answer(self, data: bytes) -> None:
        message = can.Message(arbitration_id=0x7E4, data=data.ljust(8, b"\0"), is_extended_id=False)
        self.timers.append(threading.Timer(self.delay_s, self.bus.send, [message]))
        self.timers[-1].start()


@contextmanager
def sluggish_device(name: str, serial: int, delay_s: float) -> Iterator[None]:
    stop = threading.Event()
    slow = Sluggish(name, address(serial).numbers, delay_s)
    thread = threading.Thread(target=slow.serve, args=(stop,))
    thread.start()
    try:
        yield
    finally:
        stop.set()
        thread.join()


def test_answers_that_arrive_after_the_next_request_are_not_read_as_bits() -> None:
    """One device is fast. The other answers when the next request has been sent."""
    with ExitStack() as stack:
        name = stack.enter_context(bus_with(device(3)))
        stack.enter_context(sluggish_device(name, 6, 0.0015))
        master = stack.enter_context(master_on(name, 0.04, lead=False))
        assert _found_at_last(master) == [address(3), address(6)]


def _found_at_last(master: LssMaster) -> list[LssAddress]:
    """Search again after an error, because a busy machine may delay answers further."""
    for _ in range(5):
        try:
            return master.unconfigured()
        except LssError:
            continue
    return []


def test_a_device_too_slow_for_the_timeout_does_not_give_a_wrong_identity() -> None:
    with ExitStack() as stack:
        name = stack.enter_context(bus_with())
        stack.enter_context(sluggish_device(name, 0x0F0F0F0F, 0.015))
        master = stack.enter_context(master_on(name, 0.012, lead=False))
        try:
            found = master.unconfigured()
        except LssError as error:
            assert "longer --timeout" in str(error)
        else:
            assert found in ([], [address(0x0F0F0F0F)])


def test_a_babbling_node_does_not_block_the_search() -> None:
    """The node sends LSS answers without end, faster than the master can read them."""
    with bus_with() as name, can.Bus(interface="simbus", channel=name) as babbler:
        stop = threading.Event()

        def babble() -> None:
            noise = can.Message(arbitration_id=0x7E4, data=bytes(8), is_extended_id=False)
            while not stop.is_set():
                babbler.send(noise)

        thread = threading.Thread(target=babble)
        thread.start()
        try:
            with master_on(name, lead=False) as master:
                assert master.node_id_in_use(5, 0.05) == ""
                assert not master.has_unconfigured()
        finally:
            stop.set()
            thread.join()
