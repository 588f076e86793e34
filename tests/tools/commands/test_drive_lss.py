"""`cdpr drive lss` on unconfigured simulated drives."""

from __future__ import annotations

import io
import json
import os
import subprocess
import sys
import time
import uuid
from collections.abc import Iterator
from contextlib import contextmanager, redirect_stdout
from pathlib import Path
from typing import Any
from unittest import mock

import can
import canopen
import pytest
from cdpr_here import cdpr_here
from waiting import until

from cdpr_drivers.errors import DriverError
from cdpr_profiles import ProfileError, load_drive
from cdpr_tools.command_group import load
from cdpr_tools.errors import CommandError

WINCH = "winch-mpp0923d"
EDS = load_drive("generic-cia402").eds
QUICK = ("--timeout-ms", "20")
TYPE = ("--profile", "generic-cia402")


@pytest.fixture(autouse=True)
def quick(monkeypatch: pytest.MonkeyPatch) -> None:
    """Shorten the wait for the last answer: devices in one process answer together."""
    monkeypatch.setattr("cdpr_drivers.canopen.lss._SETTLE_S", 0.001)


@contextmanager
def simulator(*options: str | Path, winch: str | Path = WINCH) -> Iterator[str]:
    """Run drives on a bus. Yield its name."""
    name = f"lss-{os.getpid()}-{uuid.uuid4().hex[:6]}"
    words = ["sim", "up", str(winch), "--bus", f"simbus:{name}", "--exit-with-stdin"]
    command = [sys.executable, "-m", "cdpr_tools.cli", *words, *map(str, options)]
    process = subprocess.Popen(
        command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE
    )
    try:
        assert process.stdout is not None
        line = process.stdout.readline()
        assert b"ready" in line, process.communicate()[1]
        yield name
    finally:
        process.communicate(timeout=120)


COMMAND = load("groups", "drive")


def lss(bus: str, *arguments: str) -> tuple[int, str, str]:
    """Run the command. Return exit status, text and error like `cdpr`."""
    out = io.StringIO()
    words = ["lss", "--bus", bus, *QUICK, *arguments]
    try:
        with redirect_stdout(out), mock.patch.object(sys, "stdin", io.StringIO("n\n")):
            COMMAND.main(words, standalone_mode=False)
    except (CommandError, ProfileError, DriverError) as error:
        bad = isinstance(error, ProfileError)
        status = error.exit_status if isinstance(error, CommandError) else 2 if bad else 1
        return status, out.getvalue(), str(error)
    return 0, out.getvalue(), ""


def told(bus: str, *arguments: str) -> dict[str, Any]:
    status, text, errors = lss(bus, *arguments, "--json")
    assert status == 0, errors
    return dict(json.loads(text.splitlines()[-1]))


def refused(status: int, bus: str, *arguments: str) -> str:
    code, _, errors = lss(bus, *arguments)
    assert code == status, errors
    return errors


def answers(name: str, node: int, timeout_s: float = 60.0) -> bool:
    """Return whether a third-party master can read the node's device type."""
    with canopen.Network() as network:
        network.NOTIFIER_CYCLE = 0.05
        network.connect(interface="simbus", channel=name)
        remote = network.add_node(node, str(EDS))
        remote.sdo.RESPONSE_TIMEOUT = 0.2
        end = time.monotonic() + timeout_s
        while time.monotonic() < end:
            try:
                return bool(remote.sdo[0x1000].raw == 0x20192)
            except canopen.SdoCommunicationError:
                continue
    return False


def test_new_drives_get_stored_node_ids(tmp_path: Path) -> None:
    store = ("--store", tmp_path / "memory")
    with simulator("--nodes", "2", "--unconfigured", *store) as name:
        bus = f"simbus:{name}"
        status, text, errors = lss(bus, "--node-id", "5")
        assert status == 2
        assert text.startswith("2 devices found\n  vendor 00CD9A01h, product 00000402h, ")
        assert text.count("no node id; profile generic-cia402") == 2
        assert "2 devices found: choose one by --serial (1, 2)" in errors
        result = told(bus, *TYPE, "--serial", "2", "--node-id", "5")
        assert result["set"] == {"node_id": 5, "bitrate_bit_s": None, "stored": True}
        assert answers(name, 5)
        message = refused(2, bus, "--node-id", "5")
        assert "--node-id 5: taken by another node (it answers SDO requests)" in message
        found = told(bus, *TYPE, "--serial", "2")["found"]
        assert [(one["serial"], one["node_id"]) for one in found] == [(2, 5)]
        told(bus, *TYPE, "--serial", "2", "--node-id", "7")
        assert answers(name, 7)
        assert not answers(name, 5, 0.3)
        nowhere = "no device of vendor 00CD9A01h found"
        assert nowhere in refused(1, bus, *TYPE, "--serial", "3", "--node-id", "9")
        assert nowhere in refused(1, bus, *TYPE, "--serial", "3")
    with simulator("--nodes", "2", "--unconfigured", *store) as name:
        assert answers(name, 7)


def test_a_single_drive_gets_a_stored_bit_rate(tmp_path: Path) -> None:
    store = ("--store", tmp_path)
    with simulator(*store) as name:
        bus = f"simbus:{name}"
        status, text, _ = lss(bus, "--alone", "--bitrate", "500k")
        assert status == 0
        assert "500 kbit/s take effect at the next power-on" in text
        assert answers(name, 1)  # the bit rate has not changed yet
        words = ("--alone", "--bitrate", "500k", "--activate", "--switch-delay-ms", "20")
        status, text, _ = lss(bus, *words)
        assert status == 0
        assert "changes to 500 kbit/s after 0.02 s" in text
        time.sleep(0.1)
        assert not answers(name, 1, 0.5)
    winch = tmp_path / "slow.toml"
    text = (Path(__file__).parents[3] / "profiles" / "winches" / f"{WINCH}.toml").read_text()
    assert "bitrate_bit_s = 1000000" in text
    winch.write_text(text.replace("bitrate_bit_s = 1000000", "bitrate_bit_s = 500000"))
    with simulator(*store, winch=winch) as name:
        assert answers(name, 1)


def test_a_damaged_store_is_reported(tmp_path: Path) -> None:
    (tmp_path / "drive-1.json").write_text("{")
    ended = cdpr_here("sim", "up", WINCH, "--bus", "simbus:never", "--store", tmp_path)
    assert ended.returncode == 2
    assert "drive-1.json: is not valid JSON" in ended.stderr


def test_an_enabled_drive_gets_no_node_id() -> None:
    """Another master has enabled the drive."""
    with simulator("--paced") as name, canopen.Network() as network:
        network.NOTIFIER_CYCLE = 0.05
        network.connect(interface="simbus", channel=name)
        node = network.add_node(1, str(EDS))
        node.sdo.RESPONSE_TIMEOUT = 60.0
        node.sdo[0x6060].raw = 10
        for word in (6, 7, 15):
            node.sdo[0x6040].raw = word
            state = {6: 0x21, 7: 0x23, 15: 0x27}[word]
            until(lambda state=state: node.sdo[0x6041].raw & 0x6F == state)
        message = refused(1, f"simbus:{name}", "--alone", "--node-id", "9")
        assert "node 1 has its power stage enabled: stop the other master first" in message
        assert node.sdo[0x6041].raw & 0x6F == 0x27
        network.send_message(0, bytes([2, 1]))  # stopped: it does not answer SDO
        message = refused(1, f"simbus:{name}", "--alone", "--node-id", "9")
        assert (
            "node 1 does not report whether its power stage is enabled: it does not answer"
            in message
        )


@pytest.mark.parametrize(
    ("arguments", "problem"),
    [
        (("--bitrate", "123k"), "--bitrate 123k: allowed: 1000k, 800k, 500k, 250k"),
        (("--activate",), "--activate: allowed only with --bitrate"),
        (("--serial", str(1 << 32)), "--serial 4294967296: allowed: 0 to 4294967295"),
        (("--profile", "nobodys"), "no profile named 'nobodys'"),
        ((), "no simulated bus of that name"),
    ],
)
def test_wrong_arguments_are_reported(arguments: tuple[str, ...], problem: str) -> None:
    assert problem in refused(2, "simbus:nobody-runs-this", *arguments)


def test_a_private_simulated_bus_is_rejected() -> None:
    assert "name an existing bus" in refused(2, "simbus:")


def test_writing_on_a_real_bus_needs_a_confirmation() -> None:
    """python-can's `virtual` bus counts as real, because it is not a simbus."""
    bus = f"virtual:lss-{os.getpid()}"
    with can.Bus(bus.partition(":")[2], "virtual", receive_own_messages=False) as device:
        answering = Answering(device)
        notifier = can.Notifier(device, [answering], timeout=0.05)
        try:
            message = refused(2, bus, "--alone", "--node-id", "9")
            assert "not confirmed (--yes confirms in advance); nothing was changed" in message
            assert answering.written == []
            status, text, errors = lss(bus, "--alone", "--node-id", "9", "--yes")
            assert (status, "it cannot store" in errors) == (1, True), errors
            assert "serial 0: node id unknown; no profile fits" in text
            assert answering.written == [0x11, 0x17]
        finally:
            notifier.stop()


class Answering(can.Listener):
    """An old device that reports its identity but no node id, accepts one, and cannot store it."""

    def __init__(self, bus: can.BusABC) -> None:
        self.bus = bus
        self.written: list[int] = []

    def on_message_received(self, message: can.Message) -> None:
        command = message.data[0]
        if message.arbitration_id != 0x7E5:
            return
        if command in (0x11, 0x17):
            self.written.append(command)
        answer = b"\x01" if command == 0x17 else b"\x00"
        if command in (0x5A, 0x5B, 0x5C, 0x5D, 0x11, 0x17):
            data = (bytes([command]) + answer).ljust(8, b"\0")
            self.bus.send(can.Message(arbitration_id=0x7E4, data=data, is_extended_id=False))
