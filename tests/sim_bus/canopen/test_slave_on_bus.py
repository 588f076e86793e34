"""The slave on the real hub, with the `canopen` package as a third party on the bus."""

from __future__ import annotations

import os
import threading
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import canopen
import pytest

from cdpr_sim_bus.bus.hub import Hub
from cdpr_sim_bus.canopen import CanopenSlave, ObjectDictionary
from tests.sim_bus.canopen.slave_bench import GENERIC_EDS, MASTER, NODE, Recorder


@dataclass
class Site:
    """A slave on a bus of its own and a third party's network on the same bus."""

    slave: CanopenSlave
    app: Recorder
    od: ObjectDictionary
    network: canopen.Network
    remote: canopen.RemoteNode


def wait_for(condition: Callable[[], bool], timeout_s: float = 60.0) -> bool:
    end = time.monotonic() + timeout_s
    while time.monotonic() < end:
        if condition():
            return True
        time.sleep(0.002)
    return condition()


@pytest.fixture
def site(request: pytest.FixtureRequest) -> Iterator[Site]:
    name = f"slave-{os.getpid()}-{request.node.name}"[:60]
    od = ObjectDictionary.from_eds(GENERIC_EDS, NODE)
    app = Recorder()
    slave = CanopenSlave(od, NODE, app)
    hub = Hub([slave], name=name)
    hub.listen()
    thread = threading.Thread(target=hub.run)
    network = canopen.Network()
    remote = network.add_node(NODE, str(GENERIC_EDS))
    try:
        thread.start()
        remote.sdo.RESPONSE_TIMEOUT = 60.0
        network.connect(interface="simbus", channel=name)
        # the first frame on the bus is what the slave is switched on with
        assert remote.sdo[0x1000].raw
        network.scanner.reset()
        yield Site(slave, app, od, network, remote)
    finally:
        network.disconnect()
        hub.stop()
        thread.join()
        hub.close()


def test_third_party_resets_starts_and_stops_the_node(site: Site) -> None:
    nmt = site.remote.nmt
    seen: list[bytes] = []
    site.network.subscribe(0x700 + NODE, lambda _id, data, _time: seen.append(bytes(data)))
    nmt.send_command(129)
    assert wait_for(lambda: seen == [b"\0"])
    site.remote.sdo[0x1017].raw = 20
    for state, code in (("OPERATIONAL", 5), ("STOPPED", 4), ("PRE-OPERATIONAL", 127)):
        nmt.state = state
        # one of before may be on its way
        assert wait_for(lambda code=code: seen[-1] == bytes([code]))
        nmt.wait_for_heartbeat(timeout=60)
        assert nmt.state == state


def test_third_party_scans_and_reads_identity(site: Site) -> None:
    site.network.scanner.search()
    assert wait_for(lambda: site.network.scanner.nodes == [NODE])
    identity = site.remote.sdo[0x1018]
    assert [identity[k].raw for k in range(1, 5)] == [0x00CD9A01, 0x402, 0x10000, 1]


def test_third_party_moves_a_large_block_both_ways(site: Site) -> None:
    content = bytes(range(256)) * 16
    with site.remote.sdo.open(0x2F10, 0, "wb", size=len(content), block_transfer=True) as stream:
        stream.write(content)
    with site.remote.sdo.open(0x2F10, 0, "rb", block_transfer=True) as stream:
        assert stream.read() == content
    assert site.remote.sdo.upload(0x2F10, 0) == content


def test_third_party_runs_pdos_by_sync(site: Site) -> None:
    remote = site.remote
    remote.tpdo.read()
    remote.rpdo.read()
    tpdo = remote.tpdo[1]
    tpdo.clear()
    for index in (0x6064, 0x6041):
        tpdo.add_variable(index)
    tpdo.trans_type = 1
    tpdo.save()
    rpdo = remote.rpdo[1]
    rpdo[0x6040].raw = 6
    rpdo[0x6071].raw = -55
    site.od.set(0x6064, 0, -4711)
    remote.nmt.state = "OPERATIONAL"
    rpdo.transmit()
    received = threading.Event()
    tpdo.add_callback(lambda _map: received.set())
    site.network.sync.transmit()
    assert received.wait(60.0)
    assert tpdo[0x6064].raw == -4711
    assert (site.od.get(0x6040), site.od.get(0x6071)) == (6, -55)


def test_third_party_hears_of_a_lost_heartbeat(site: Site) -> None:
    site.remote.sdo[0x1016][1].raw = MASTER << 16 | 100
    site.remote.nmt.state = "OPERATIONAL"
    site.network.send_message(0x700 + MASTER, b"\x05")
    assert wait_for(lambda: bool(site.remote.emcy.active))
    (emergency,) = site.remote.emcy.active
    assert (emergency.code, emergency.register) == (0x8130, 0x11)
    assert site.remote.sdo[0x1003][1].raw & 0xFFFF == 0x8130
    assert ("heartbeat_lost", MASTER) in site.app.events


def test_third_party_asks_by_remote_frames(site: Site) -> None:
    """Node guarding, and a TPDO that is sent on request only."""
    seen: list[tuple[int, bytes]] = []
    for identifier in (0x700 + NODE, 0x180 + NODE):
        site.network.subscribe(identifier, lambda id_, data, _time: seen.append((id_, bytes(data))))
    site.network.send_message(0x700 + NODE, b"", remote=True)
    assert wait_for(lambda: seen == [(0x700 + NODE, b"\x7f")])
    site.network.send_message(0x700 + NODE, b"", remote=True)
    assert wait_for(lambda: seen[1:] == [(0x700 + NODE, b"\xff")])
    tpdo = site.remote.tpdo[1]
    tpdo.read()
    tpdo.trans_type = 253
    tpdo.save()
    site.remote.nmt.state = "OPERATIONAL"
    site.network.send_message(0x180 + NODE, b"", remote=True)
    assert wait_for(lambda: len(seen) > 2 and seen[2][0] == 0x180 + NODE)
