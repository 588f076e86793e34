"""Only one process of a computer runs the drives on a bus."""

from __future__ import annotations

import os
import subprocess
import uuid
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from fork_server import FORKED

from cdpr_drivers.bus import BusUrl
from cdpr_drivers.bus.url import MasterLock, refuse_second_master
from cdpr_drivers.errors import BusError

HOLDER = """
import sys
from cdpr_drivers.bus import BusUrl
from cdpr_drivers.bus.url import MasterLock
lock = MasterLock(BusUrl.parse(sys.argv[1]))
print(flush=True)
sys.stdin.read()
"""


@contextmanager
def held_elsewhere(url: str) -> Iterator[subprocess.Popen[bytes]]:
    command = [*FORKED, HOLDER, url]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE) as process:
        try:
            assert process.stdout is not None
            assert process.stdout.readline() == b"\n"
            yield process
        finally:
            process.kill()


@pytest.fixture
def url() -> BusUrl:
    return BusUrl.parse(f"simbus:lock-{os.getpid()}-{uuid.uuid4().hex[:6]}")


def test_a_second_master_is_rejected_with_the_process_id_of_the_first(url: BusUrl) -> None:
    refuse_second_master(url)
    with held_elsewhere(str(url)) as process:
        for attempt in (MasterLock, refuse_second_master):
            with pytest.raises(BusError, match=f"process {process.pid} .*end that process first"):
                attempt(url)
        process.kill()  # without cleaning up
        process.wait()
    with MasterLock(url), pytest.raises(BusError, match=f"process {os.getpid()} "):
        MasterLock(url)
    refuse_second_master(url)
    MasterLock(url).close()


def test_masters_on_different_buses_do_not_conflict(url: BusUrl) -> None:
    with MasterLock(url):
        other = BusUrl.parse(f"{url}-b")
        refuse_second_master(other)
        with MasterLock(other):
            pass


def test_different_urls_of_the_same_bus_conflict(tmp_path: Path) -> None:
    device, link = tmp_path / "ttyACM0", tmp_path / "by-id"
    link.symlink_to(device)
    pairs = [
        (f"slcan:{device}?bitrate=1000000", f"slcan:{link}?bitrate=500000"),
        (f"socketcan:lock{os.getpid()}", f"socketcan:lock{os.getpid()}?lockstep=true"),
        ("socketcand://host:29536/can7", "socketcand://host:29536/can7?lockstep=true"),
        (f"slcan:/{'long' * 40}", f"slcan:/{'long' * 40}?bitrate=500000"),
    ]
    for first, second in pairs:
        with MasterLock(BusUrl.parse(first)), pytest.raises(BusError, match="runs the drives"):
            MasterLock(BusUrl.parse(second))
    with MasterLock(BusUrl.parse("socketcand://host:29536/can7")):
        refuse_second_master(BusUrl.parse("socketcand://host:29536/can8"))
        refuse_second_master(BusUrl.parse("socketcand://host:29537/can7"))
