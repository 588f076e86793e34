"""SDO, NMT and EMCY of the master, with a simulated drive."""

from __future__ import annotations

from functools import partial

import pytest

from cdpr_drivers.canopen.network import CanNetwork
from cdpr_drivers.errors import SdoError
from tests.drivers.axis_rig import Rig, open_network
from tests.fault_texts import alarm


@pytest.fixture
def network(rig: Rig) -> CanNetwork:
    return rig.network


def test_a_value_too_large_for_its_type_is_not_sent(network: CanNetwork) -> None:
    with pytest.raises(SdoError, match="does not fit"):
        network.write(1, 0x6060, 0, 1000)


def test_an_object_the_eds_lacks_is_reported(network: CanNetwork) -> None:
    with pytest.raises(SdoError, match="5F00h:0 is not in the drive's EDS"):
        network.read(1, 0x5F00)
    with pytest.raises(SdoError, match="1018h:9 is not in the drive's EDS"):
        network.read(1, 0x1018, 9)


def test_a_silent_node_is_reported_after_the_attempts(bus: str) -> None:
    with open_network(bus, [9]) as network:
        begin_s = network.clock.now_s
        with pytest.raises(SdoError, match="node 9"):
            network.read(9, 0x1000, attempts=1)
        assert network.clock.now_s - begin_s == pytest.approx(0.5)


def test_several_tasks_may_read_from_one_node_simultaneously(rig: Rig) -> None:
    def work(node_objects: list[tuple[int, int, int]]) -> bool:
        return all(
            rig.network.read_int(1, index, sub) == value
            for _ in range(40)
            for index, sub, value in node_objects
        )

    jobs = [
        [(0x1018, 1, 0x00CD9A01), (0x6076, 0, 3000)],
        [(0x1018, 2, 0x402), (0x608F, 1, 8192)],
        [(0x1000, 0, 0x00020192), (0x608F, 2, 1)],
    ]
    tasks = [rig.network.clock.start(partial(work, job)) for job in jobs]
    rig.set_mode()
    for _ in range(1000):  # one answer per cycle, because all three ask the same node
        rig.cycle()
        rig.network.clock.run_tasks()
    assert all(task.result() for task in tasks)
    assert alarm(rig.group) == ""
