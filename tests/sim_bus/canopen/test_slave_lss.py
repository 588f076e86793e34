"""The LSS slave with the LSS master of the `canopen` package."""

from __future__ import annotations

from pathlib import Path

import pytest
from canopen.lss import LssError, LssMaster

from cdpr_sim_bus.canopen import ParameterStore
from cdpr_sim_bus.canopen.lss import UNCONFIGURED
from tests.sim_bus.canopen.slave_bench import NODE, Bench

VENDOR, PRODUCT, REVISION = 0x00CD9A01, 0x00000402, 0x00010000
SERIAL = 0x89ABCDEF


@pytest.fixture
def master(monkeypatch: pytest.MonkeyPatch) -> type[LssMaster]:
    monkeypatch.setattr(LssMaster, "RESPONSE_TIMEOUT", 0.001)
    monkeypatch.setattr("canopen.lss.time.sleep", lambda _s: None)
    return LssMaster


def lss_bench(node_id: int, store: ParameterStore | None = None) -> Bench:
    bench = Bench(node_id=node_id, store=store)
    bench.od.set_default(0x1018, 4, SERIAL)
    return bench.boot()


def test_a_selected_device_answers_inquiries_of_its_address(master: type[LssMaster]) -> None:
    bench = lss_bench(NODE)
    lss = bench.network.lss
    with pytest.raises(LssError):
        lss.send_switch_state_selective(VENDOR, PRODUCT, REVISION, SERIAL + 1)
    with pytest.raises(LssError):
        lss.inquire_node_id()
    assert lss.send_switch_state_selective(VENDOR, PRODUCT, REVISION, SERIAL)
    assert lss.inquire_node_id() == NODE
    address = [lss.inquire_lss_address(command) for command in range(0x5A, 0x5E)]
    assert address == [VENDOR, PRODUCT, REVISION, SERIAL]
    lss.send_switch_state_global(lss.WAITING_STATE)
    with pytest.raises(LssError):
        lss.inquire_node_id()


def test_a_new_node_id_is_active_after_a_communication_reset(
    master: type[LssMaster], tmp_path: Path
) -> None:
    path = tmp_path / "drive.json"
    bench = lss_bench(NODE, ParameterStore(path))
    lss = bench.network.lss
    lss.send_switch_state_global(lss.CONFIGURATION_STATE)
    with pytest.raises(LssError):
        lss.configure_node_id(128)
    with pytest.raises(LssError):
        lss.configure_node_id(0)
    lss.configure_node_id(33)
    lss.store_configuration()
    lss.send_switch_state_global(lss.WAITING_STATE)
    assert bench.sdo(b"\x40\x00\x10")[0] == 0x43
    assert bench.nmt(130) == [(0x700 + 33, b"\0")]
    assert bench.slave.node_id == 33
    assert bench.send(0x600 + NODE, b"\x40\x00\x10".ljust(8, b"\0")) == []
    assert bench.sdo(b"\x40\x00\x18\x01")[4:] == (0x180 + 33).to_bytes(4, "little")
    again = Bench(node_id=NODE, store=ParameterStore(path))
    again.slave.advance(0.0)
    assert again.take() == [(0x700 + 33, b"\0")]


def test_store_that_fails_is_reported(master: type[LssMaster], tmp_path: Path) -> None:
    bench = lss_bench(NODE, ParameterStore(tmp_path / "missing" / "drive.json"))
    lss = bench.network.lss
    lss.send_switch_state_global(lss.CONFIGURATION_STATE)
    with pytest.raises(LssError, match="2"):
        lss.store_configuration()


def test_unconfigured_node_is_found_by_fastscan_and_boots(master: type[LssMaster]) -> None:
    bench = lss_bench(UNCONFIGURED)
    assert bench.run_to(10.0) == []
    assert bench.nmt(1, 0) == []
    lss = bench.network.lss
    assert bench.send(0x7E5, b"\x4c".ljust(8, b"\0")) == [(0x7E4, b"\x50".ljust(8, b"\0"))]
    assert lss.fast_scan() == (True, [VENDOR, PRODUCT, REVISION, SERIAL])
    assert lss.inquire_node_id() == UNCONFIGURED
    lss.configure_node_id(7)
    booted = bench.send(0x7E5, bytes([4, 0]).ljust(8, b"\0"))
    assert booted == [(0x707, b"\0")]
    assert bench.sdo(b"\x40\x00\x10")[0] == 0x43
    assert lss.fast_scan() == (False, None)


def test_identify_answers_within_the_range_only(bench: Bench) -> None:
    def identify(*address: int) -> list[tuple[int, bytes]]:
        answers = []
        for command, number in zip(range(0x46, 0x4C), address, strict=True):
            answers += bench.send(0x7E5, bytes([command]) + number.to_bytes(7, "little"))
        return answers

    found = [(0x7E4, b"\x4f".ljust(8, b"\0"))]
    assert identify(VENDOR, PRODUCT, 0, 0xFFFFFFFF, 0, 0xFFFFFFFF) == found
    assert identify(VENDOR, PRODUCT, REVISION, REVISION, 1, 1) == found
    assert identify(VENDOR, PRODUCT, REVISION, REVISION, 2, 9) == []
    assert identify(VENDOR + 1, PRODUCT, 0, 0xFFFFFFFF, 0, 0xFFFFFFFF) == []


def test_bit_timing_is_checked_and_activated_after_silence(master: type[LssMaster]) -> None:
    bench = lss_bench(NODE)
    bench.write(0x1017, 0, (10).to_bytes(2, "little"))
    lss = bench.network.lss
    lss.send_switch_state_global(lss.CONFIGURATION_STATE)
    with pytest.raises(LssError):
        lss.configure_bit_timing(5)
    lss.configure_bit_timing(2)
    lss.activate_bit_timing(100)
    assert bench.run_to(0.19) == []
    assert bench.send(0x600 + NODE, b"\x40\x00\x10".ljust(8, b"\0")) == []
    assert bench.slave.bitrate == 1_000_000
    assert bench.run_to(0.3) == []  # a bus at 1 Mbit/s does not receive its frames any more
    assert bench.slave.bitrate == 500_000
    assert bench.send(0x600 + NODE, b"\x40\x00\x10".ljust(8, b"\0")) == []
