"""NMT, boot-up, heartbeat producer and consumer, and emergencies of a slave."""

from __future__ import annotations

import struct

import canopen
import pytest

from cdpr_sim_bus.canopen import NmtState
from tests.sim_bus.canopen.slave_bench import MASTER, NODE, RTR, Bench

HEARTBEAT = 0x700 + NODE
EMCY = 0x80 + NODE


def watch_master(bench: Bench, period_ms: int) -> None:
    bench.write(0x1016, 1, (MASTER << 16 | period_ms).to_bytes(4, "little"))


def beat(bench: Bench, state: int = 5, node: int = MASTER) -> list[tuple[int, bytes]]:
    return bench.send(0x700 + node, bytes([state]))


def test_boot_up_is_one_message_and_waits_until_time_runs() -> None:
    bench = Bench()
    assert bench.take() == []
    assert bench.slave.next_event() <= 0.0
    bench.slave.advance(0.0)
    assert bench.take() == [(HEARTBEAT, b"\0")]
    assert bench.slave.nmt_state is NmtState.PRE_OPERATIONAL
    assert bench.app.events == [("reset",), ("nmt", NmtState.PRE_OPERATIONAL)]
    assert bench.run_to(10.0) == []


@pytest.mark.parametrize("address", [0, NODE])
def test_every_nmt_command_is_obeyed(bench: Bench, address: int) -> None:
    slave = bench.slave
    for command, state in ((1, 5), (2, 4), (128, 127), (2, 4), (1, 5), (128, 127)):
        assert bench.nmt(command, address) == []
        assert slave.nmt_state == state
    assert bench.nmt(130, address) == [(HEARTBEAT, b"\0")]
    assert slave.nmt_state == NmtState.PRE_OPERATIONAL
    assert bench.nmt(129, address) == [(HEARTBEAT, b"\0")]


def test_nmt_for_others_and_nonsense_is_ignored(bench: Bench) -> None:
    for command, node in ((1, NODE + 1), (77, NODE), (0, 0)):
        bench.nmt(command, node)
    bench.send(0, b"\x01")
    bench.send(0, bytes([1, NODE, 0]))
    assert bench.slave.nmt_state == NmtState.PRE_OPERATIONAL


def test_heartbeat_is_sent_at_its_period_with_the_nmt_state(bench: Bench) -> None:
    bench.write(0x1017, 0, (250).to_bytes(2, "little"))
    bench.nmt(1)
    sent = bench.run_to(1.0)
    assert [when for when, *_ in sent] == pytest.approx([0.25, 0.5, 0.75, 1.0])
    assert {(i, data) for _, i, data in sent} == {(HEARTBEAT, b"\x05")}
    bench.nmt(2)
    assert bench.run_to(1.3)[0][2] == b"\x04"
    bench.nmt(128)
    bench.write(0x1017, 0, b"\0\0")
    assert bench.run_to(5.0) == []


def test_node_guarding_request_is_answered_with_a_toggle(bench: Bench) -> None:
    assert bench.send(HEARTBEAT | RTR) == [(HEARTBEAT, b"\x7f")]
    assert bench.send(HEARTBEAT | RTR) == [(HEARTBEAT, b"\xff")]
    bench.write(0x1017, 0, (100).to_bytes(2, "little"))
    assert bench.send(HEARTBEAT | RTR) == []


def test_monitoring_begins_with_the_first_heartbeat(bench: Bench) -> None:
    watch_master(bench, 100)
    bench.start()
    assert bench.run_to(5.0) == []
    beat(bench)
    bench.run_to(5.09)
    beat(bench)
    assert bench.run_to(5.18) == []
    ((when, identifier, data),) = bench.run_to(6.0)
    assert when == pytest.approx(5.19)
    assert (identifier, data) == (EMCY, struct.pack("<HB5s", 0x8130, 0x11, bytes([MASTER])))
    assert ("heartbeat_lost", MASTER) in bench.app.events
    assert bench.slave.nmt_state == NmtState.PRE_OPERATIONAL
    assert beat(bench) == [(EMCY, bytes(8))]
    assert len(bench.run_to(8.0)) == 1


@pytest.mark.parametrize(
    ("behaviour", "state"),
    [(0, NmtState.PRE_OPERATIONAL), (1, NmtState.OPERATIONAL), (2, NmtState.STOPPED)],
)
def test_loss_of_the_master_leads_to_the_state_in_1029h(
    bench: Bench, behaviour: int, state: NmtState
) -> None:
    bench.write(0x1029, 1, bytes([behaviour]))
    watch_master(bench, 50)
    bench.start()
    beat(bench)
    bench.run_to(1.0)
    assert bench.slave.nmt_state is state


def test_restart_of_a_monitored_node_counts_as_loss(bench: Bench) -> None:
    watch_master(bench, 100)
    assert beat(bench, 0) == []
    beat(bench)
    assert beat(bench, 0)[0][1][:2] == b"\x30\x81"
    assert ("heartbeat_lost", MASTER) in bench.app.events


def test_consumers_are_checked_and_independent(bench: Bench) -> None:
    watch_master(bench, 100)
    with pytest.raises(canopen.SdoAbortedError) as caught:
        bench.write(0x1016, 2, (MASTER << 16 | 200).to_bytes(4, "little"))
    assert caught.value.code == 0x06040043
    with pytest.raises(canopen.SdoAbortedError) as caught:
        bench.write(0x1016, 2, (200 << 16 | 200).to_bytes(4, "little"))
    assert caught.value.code == 0x06090030
    bench.write(0x1016, 2, (9 << 16 | 200).to_bytes(4, "little"))
    beat(bench)
    beat(bench, node=9)
    lost = [(round(when, 6), data[3]) for when, i, data in bench.run_to(1.0) if i == EMCY]
    assert lost == [(0.1, MASTER)]
    assert [e for e in bench.app.events if e[0] == "heartbeat_lost"] == [
        ("heartbeat_lost", MASTER),
        ("heartbeat_lost", 9),
    ]
    beat(bench)
    assert bench.od.get(0x1001) == 0x11
    beat(bench, node=9)
    assert bench.od.get(0x1001) == 0


def test_ending_the_monitoring_clears_the_error(bench: Bench) -> None:
    watch_master(bench, 100)
    beat(bench)
    bench.run_to(1.0)
    bench.write(0x1016, 1, bytes(4))
    assert bench.od.get(0x1001) == 0
    assert beat(bench) == []
    assert bench.run_to(2.0) == []


def test_emergencies_are_sent_once_and_kept_in_register_and_history(bench: Bench) -> None:
    slave = bench.slave
    slave.emergency(0x2310, 0x02, b"\x34\x12xyz")
    slave.emergency(0x2310, 0x02)
    slave.emergency(0x7305, 0x20)
    assert bench.take() == [
        (EMCY, struct.pack("<HB5s", 0x2310, 0x03, b"\x34\x12xyz")),
        (EMCY, struct.pack("<HB5s", 0x7305, 0x23, b"")),
    ]
    history = bench.remote.sdo[0x1003]
    assert [history[0].raw, history[1].raw, history[2].raw] == [2, 0x7305, 0x12342310]
    slave.emergency_clear(0x2310)
    slave.emergency_clear(0x2310)
    assert bench.take() == [(EMCY, struct.pack("<HB5s", 0, 0x21, b""))]
    slave.emergency_clear()
    assert bench.take() == [(EMCY, bytes(8))]
    history[0].raw = 0
    assert history[0].raw == 0
    with pytest.raises(canopen.SdoAbortedError):
        bench.read(0x1003, 1)


def test_history_keeps_the_newest_errors(bench: Bench) -> None:
    for code in range(0xFF00, 0xFF20):
        bench.slave.emergency(code, 0x80)
    length = len(bench.od.subs(0x1003))
    assert bench.od.get(0x1003) == length
    kept = [bench.od.get(0x1003, sub) for sub in range(1, length + 1)]
    assert kept == list(range(0xFF1F, 0xFF1F - length, -1))


def test_inhibit_time_spaces_emergencies_in_bus_time(bench: Bench) -> None:
    bench.write(0x1015, 0, (100).to_bytes(2, "little"))
    for code in (0xFF01, 0xFF02, 0xFF03):
        bench.slave.emergency(code, 0)
    sent = [(0.0, *frame) for frame in bench.take()] + bench.run_to(1.0)
    assert [when for when, *_ in sent] == pytest.approx([0.0, 0.01, 0.02])
    assert [data[0] for *_, data in sent] == [1, 2, 3]


def test_emergency_waits_in_stopped_and_can_be_disabled(bench: Bench) -> None:
    bench.nmt(2)
    bench.slave.emergency(0xFF01, 0)
    assert bench.take() == []
    assert [i for i, _ in bench.nmt(128)] == [EMCY]
    bench.write(0x1014, 0, (0x80000000 | EMCY).to_bytes(4, "little"))
    bench.slave.emergency(0xFF02, 0)
    assert bench.take() == []
    bench.write(0x1014, 0, (0x90).to_bytes(4, "little"))
    bench.slave.emergency(0xFF03, 0)
    assert [i for i, _ in bench.take()] == [0x90]
