"""`cdpr bus monitor` and `replay` with simulated drives and a working master."""

from __future__ import annotations

import os
import re
import signal
import struct
import subprocess
import sys
import time
import zlib
from collections.abc import Iterator
from pathlib import Path

import can
import pytest
from cdpr_here import cdpr_here
from waiting import until

from tests.tools.busview.bus_lab import PROBE, WINCH, Lab, begin, command, last_json


@pytest.fixture(scope="module")
def labs() -> Iterator[tuple[Lab, Lab]]:
    two = Lab("bustools", "--nodes", "2"), Lab("bustools-cut")
    for lab in two:
        lab.ready()
    yield two
    for lab in two:
        lab.close()


@pytest.fixture(scope="module")
def lab(labs: tuple[Lab, Lab]) -> Lab:
    return labs[0]


# -- monitor and replay


class Session:
    """A jog that was monitored and logged."""

    def __init__(self, lab: Lab, folder: Path) -> None:
        self.log = folder / "jog.log"
        shown = folder / "shown.txt"
        arguments = ("bus", "monitor", "--bus", lab.bus, "--winch", WINCH, "--log", self.log)
        with lab.join() as ear, shown.open("w") as screen:
            lab.passed(ear)  # the first frame switches the drives on
            monitor = subprocess.Popen(
                command(*arguments), stdout=screen, stderr=subprocess.PIPE, text=True
            )
            wait_for_log(self.log, ear)
            ear.send(PROBE)
            lab.passed(ear)  # the frame that started the drives was before the log
            jog = ("drive", "jog", WINCH, "--bus", lab.bus, "--speed-deg-s", "90")
            assert cdpr_here(*jog, "--seconds", "0.5").returncode == 0
            self.heard = lab.passed(ear)
            until(lambda: self.log.read_text().count(" 7FE#") == 2)  # markers of both
            monitor.send_signal(signal.SIGINT)
            _, self.errors = monitor.communicate(timeout=120)
        assert monitor.returncode == 0, self.errors
        self.lines = shown.read_text().splitlines()


def wait_for_log(log: Path, bus: can.BusABC) -> None:
    """Wait until a monitor logs sent frames."""

    def logs() -> bool:
        bus.send(PROBE)
        return log.exists() and log.stat().st_size > 0

    until(logs)


@pytest.fixture(scope="module")
def session(lab: Lab, tmp_path_factory: pytest.TempPathFactory) -> Session:
    return Session(lab, tmp_path_factory.mktemp("session"))


def of_kind(lines: list[str], kind: str) -> list[str]:
    return [line for line in lines if f"  {kind} " in line]


def test_monitor_decodes_a_session_to_text(session: Session) -> None:
    feedback = of_kind(session.lines, "TPDO1")
    commands = of_kind(session.lines, "RPDO1")
    assert len(feedback) > 1000
    assert any("Statusword operation enabled" in line for line in feedback)
    assert any("Controlword enable operation (000Fh)" in line for line in commands)
    assert re.search(r"Position actual value -?\d+\.\d{3} deg", feedback[0])
    assert re.search(r"Target torque -?\d+\.\d{4} Nm", commands[0])
    sdo = of_kind(session.lines, "SDO")
    assert any("-> write 1017h Producer heartbeat time = 100 ms" in line for line in sdo)
    assert any("<- 1018h:1 Identity object: Vendor-ID = 00CD9A01h" in line for line in sdo)
    assert any("start: node 1" in line for line in of_kind(session.lines, "NMT"))
    assert any("boot-up" in line for line in of_kind(session.lines, "heartbeat"))
    # SYNC frames are only counted
    assert not of_kind(session.lines, "SYNC")


def test_monitor_prints_a_summary(session: Session) -> None:
    head, _, *rows = session.errors.splitlines()
    assert re.fullmatch(
        r"\d+ frames in \d+\.\d{3} s of bus time; bus load \d+\.\d % of 1000 kbit/s, with "
        r"worst-case bit stuffing; 0 with a problem \(marked !\)",
        head,
    )
    assert "frames were lost" not in session.errors
    counts = {row.split()[0]: row.split()[1:-1] for row in rows}
    assert counts["181"] == ["1", "TPDO1", str(len(of_kind(session.lines, "TPDO1")))]
    assert counts["080"] == ["SYNC", counts["181"][-1]]
    assert int(head.split()[0]) == sum(int(row[-1]) for row in counts.values())


def test_the_log_contains_the_frames_that_others_received(session: Session) -> None:
    logged = [(m.arbitration_id, bytes(m.data)) for m in can.CanutilsLogReader(session.log)]
    logged = [frame for frame in logged if frame not in ((0x7FF, b"\1"), (0x7FE, b""))]
    heard = [(m.arbitration_id, bytes(m.data)) for m in session.heard]
    assert len(heard) > 4000
    assert logged[: len(heard)] == heard


def test_replay_prints_the_same_lines_as_monitor(session: Session) -> None:
    result = cdpr_here("bus", "replay", session.log, "--winch", WINCH)
    assert result.returncode == 0, result.stderr
    assert result.stdout.splitlines() == session.lines
    logged = len(session.log.read_text().splitlines())
    assert result.stderr.startswith(f"{logged} frames in")


def test_replay_reads_logs_of_python_can(session: Session, tmp_path: Path) -> None:
    """These are other formats, and the same format from a different writer."""
    for name in ("other.log", "other.asc", "other.blf"):
        with can.Logger(tmp_path / name) as logger:
            for message in can.CanutilsLogReader(session.log):
                logger(message)
        result = cdpr_here("bus", "replay", tmp_path / name, "--winch", WINCH)
        assert result.returncode == 0, result.stderr
        told = result.stdout.splitlines()
        assert [line[15:] for line in told] == [line[15:] for line in session.lines], name
        times = [[float(line[:12]) for line in lines] for lines in (told, session.lines)]
        assert times[0] == pytest.approx(times[1], abs=1.1e-3), (
            name
        )  # .blf has a resolution of a millisecond


def test_a_blf_file_that_unpacks_to_too_much_is_rejected(tmp_path: Path) -> None:
    path, size = tmp_path / "bomb.blf", 3 << 28
    with can.Logger(path) as logger:
        logger(can.Message(arbitration_id=0x123, data=b"\x01"))
    header = path.read_bytes()[:144]
    packer, zeros = zlib.compressobj(1), bytes(1 << 20)
    packed = b"".join(packer.compress(zeros) for _ in range(size >> 20)) + packer.flush()
    container = struct.pack("<H6xL4x", 2, size) + packed
    start = struct.pack("<4sHHLL", b"LOBJ", 16, 1, 16 + len(container), 10)
    path.write_bytes(header + start + container)
    assert "bomb.blf: python-can cannot read it: " in complaint("replay", path)


def test_raw_output_of_replay_is_a_log(session: Session) -> None:
    raw = cdpr_here("bus", "replay", session.log, "--raw", "--ids", "181,700-7FD").stdout
    frames = [
        line for line in session.log.read_text().splitlines() if re.search(" (181|7..)#", line)
    ]
    frames = [line for line in frames if not re.search(" 7F[EF]#", line)]
    assert raw.splitlines() == frames
    again = cdpr_here("bus", "replay", "-", "--raw", stdin=raw)
    assert again.stdout == raw


def test_lines_from_a_pipe_are_printed_immediately() -> None:
    replay = subprocess.Popen(
        command("bus", "replay", "-"), stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    )
    assert replay.stdin is not None
    assert replay.stdout is not None
    for state, text in (("05", "operational"), ("04", "stopped")):
        replay.stdin.write(f"(1.0) can0 709#{state}\n")
        replay.stdin.flush()
        assert replay.stdout.readline().split()[-2:] == ["heartbeat", text]
    replay.communicate(timeout=120)
    assert replay.returncode == 0


def test_replay_sends_to_a_bus(lab: Lab, tmp_path: Path) -> None:
    log = tmp_path / "short.log"
    lines = [f"({i / 50:.6f}) can0 {0x7F0 + i:03X}#0{i}" for i in range(10)]
    log.write_text("\n".join([*lines, "(0.3) can0 20000004#0001000000000000"]) + "\n")
    with lab.join() as ear:
        begun = time.monotonic()
        result = cdpr_here("bus", "replay", log, "--to", lab.bus, "--speed", "0.2", "--json")
        assert result.returncode == 0, result.stderr
        assert time.monotonic() - begun > 0.9  # 0.18 s recorded, five times as slow
        sent = [(m.arbitration_id, bytes(m.data)) for m in lab.passed(ear)]
    sent = [frame for frame in sent if frame[0] & 0x7F0 == 0x7F0]
    assert sent == [(0x7F0 + i, bytes([i])) for i in range(10)]
    told = last_json(result.stdout)
    assert (told["sent"], told["not_sent"]) == (10, 1)


def test_an_interrupted_replay_disables_the_drives(lab: Lab, tmp_path: Path) -> None:
    log = tmp_path / "motion.log"
    log.write_text("(0.0) can0 301#0F00\n(0.1) can0 7FF#01\n(600.0) can0 301#0F00\n")
    with lab.join() as ear:
        replay = begin("bus", "replay", log, "--to", lab.bus)
        while (message := ear.recv(120.0)) is not None and message.arbitration_id != 0x7FF:
            pass
        replay.send_signal(signal.SIGINT)
        _, errors = replay.communicate(timeout=120)
        after = [m for m in lab.passed(ear) if m.arbitration_id & 0x780 == 0x600]
    (last,) = after
    assert replay.returncode == 1
    assert "stopped on request" in errors
    assert (last.arbitration_id, last.data.hex()) == (0x601, "2b40600000000000")


# -- output and end of a monitor


def test_monitor_prints_plain_lines_immediately(lab: Lab) -> None:
    monitor = begin("bus", "monitor", "--bus", lab.bus, "--ids", "705")
    assert monitor.stdout is not None
    with lab.join() as bus:
        os.set_blocking(monitor.stdout.fileno(), False)
        line = ""
        until = time.monotonic() + 120
        while not line:
            assert time.monotonic() < until
            bus.send(can.Message(arbitration_id=0x705, data=[5], is_extended_id=False))
            time.sleep(0.05)
            line = monitor.stdout.readline()
    assert re.fullmatch(r"    0\.000000       705    5  heartbeat operational\n", line)
    os.set_blocking(monitor.stdout.fileno(), True)
    monitor.send_signal(signal.SIGINT)
    out, errors = monitor.communicate(timeout=120)
    assert monitor.returncode == 0
    assert (out + errors).isascii()
    assert "\x1b" not in out + errors
    assert "" not in errors.splitlines()
    assert re.match(r"\d+ frames? in ", errors)


def test_monitor_ends_after_its_time_and_counts_problems(lab: Lab) -> None:
    monitor = begin("bus", "monitor", "--bus", lab.bus, "--seconds", "3", "--ids", "711", "--json")
    with lab.join() as bus:
        while monitor.poll() is None:
            for identifier in (0x711, 0x712):
                bus.send(can.Message(arbitration_id=identifier, data=[9], is_extended_id=False))
            time.sleep(0.02)
    out, errors = monitor.communicate(timeout=120)
    assert monitor.returncode == 0, errors
    told = last_json(out)
    assert [row["id"] for row in told["ids"]] == ["711"]
    assert told["problems"] == told["frames"] > 0
    assert told["missed"] is None  # frames that filters drop are not counted
    assert told["led"] is False


def test_monitor_reports_a_bus_that_goes_away_and_keeps_the_log(
    labs: tuple[Lab, Lab], tmp_path: Path
) -> None:
    lab = labs[1]
    log = tmp_path / "cut.log"
    monitor = begin("bus", "monitor", "--bus", lab.bus, "--log", log)
    with lab.join() as bus:
        wait_for_log(log, bus)
    lab.close()
    _, errors = monitor.communicate(timeout=120)
    assert monitor.returncode == 1
    assert errors.splitlines()[-1].startswith(f"cdpr: {lab.bus}: the bus is lost")
    assert "7FF" in errors  # the summary is still printed
    assert "bus load" not in errors  # but the elapsed bus time is unknown
    assert cdpr_here("bus", "replay", log).returncode == 0


def test_a_full_disk_ends_monitor_with_an_error(lab: Lab) -> None:
    monitor = begin("bus", "monitor", "--bus", lab.bus, "--log", "/dev/full")
    with lab.join() as bus:
        while monitor.poll() is None:
            bus.send(PROBE)
            time.sleep(0.05)
    _, errors = monitor.communicate()
    assert monitor.returncode == 1
    assert (
        errors.splitlines()[-1]
        == "cdpr: --log /dev/full: cannot be written: No space left on device"
    )
    assert "Traceback" not in errors


def test_a_reader_that_does_not_read_loses_no_frame_of_the_log(lab: Lab, tmp_path: Path) -> None:
    log = tmp_path / "all.log"
    monitor = begin("bus", "monitor", "--bus", lab.bus, "--log", log)  # the lines are not read
    with lab.join() as bus:
        wait_for_log(log, bus)
        for _ in range(60):
            for i in range(100):
                bus.send(can.Message(arbitration_id=0x7FD, data=[i] * 8, is_extended_id=False))
            time.sleep(0.01)
        lab.passed(bus)
    until(lambda: log.read_text().count(" 7FD#") == 6000)
    monitor.send_signal(signal.SIGINT)
    out, errors = monitor.communicate(timeout=120)
    assert "frames were lost" not in errors
    assert log.read_text().count(" 7FD#") == 6000
    assert out.count(" 7FD ") == 6000


def test_replay_into_a_closed_pipe_prints_no_error(lab: Lab, session: Session) -> None:
    shell = f"{sys.executable} -m cdpr_tools.cli bus replay {session.log} | head -n 2"
    result = subprocess.run(
        ["bash", "-c", shell], capture_output=True, text=True, timeout=60, check=False
    )
    assert len(result.stdout.splitlines()) == 2
    assert "Traceback" not in result.stderr
    assert "Exception" not in result.stderr


# -- invalid input


def complaint(*arguments: str | Path, status: int = 2, stdin: str = "") -> str:
    result = cdpr_here("bus", *arguments, stdin=stdin)
    assert result.returncode == status, result.stderr
    assert "Traceback" not in result.stderr
    (line,) = [one for one in result.stderr.splitlines() if "cdpr: " in one]
    return line.partition("cdpr: ")[2]


def test_invalid_arguments_are_rejected(lab: Lab, tmp_path: Path) -> None:
    here = ("--bus", lab.bus)
    assert lab.bus in complaint("monitor", "--bus", "simbus:")  # the error lists running buses
    assert "'18x'" in complaint("monitor", *here, "--ids", "181,18x")
    assert "--nodes 0-3" in complaint("scan", *here, "--nodes", "0-3")
    assert "did you mean 'generic-cia402'" in complaint("monitor", *here, "--profile", "generic402")
    both = ("--profile", "generic-cia402", "--winch", WINCH)
    assert "one of them" in complaint("monitor", *here, *both)
    nowhere = tmp_path / "none" / "x.log"
    assert str(nowhere) in complaint("monitor", *here, "--log", nowhere)
    assert "is not a folder" in complaint("scan", *here, "--profiles", nowhere)


def test_invalid_logs_are_rejected(lab: Lab, tmp_path: Path) -> None:
    log = tmp_path / "trip.log"
    assert "trip.log: cannot be read" in complaint("replay", log)
    log.write_text("(1.0) can0 123#00\n(1.0) can1 123#00\n")
    assert "can0, can1" in complaint("replay", log)
    assert "--channel can7" in complaint("replay", log, "--channel", "can7")
    log.write_text("(1.0) can0 123#00\n(1.0) can0 123#0\n(1.0) can0 123#00\n")
    assert "trip.log: line 2" in complaint("replay", log, status=1)
    with lab.join() as ear:  # no line is sent
        assert "trip.log: line 2" in complaint("replay", log, "--to", lab.bus, status=1)
        assert 0x123 not in {message.arbitration_id for message in lab.passed(ear)}
    (tmp_path / "trip.blf").write_bytes(b"nothing of the kind" * 20)
    assert "trip.blf" in complaint("replay", tmp_path / "trip.blf")


def test_binary_input_is_rejected() -> None:
    strict = os.environ | {"PYTHONIOENCODING": "utf-8:strict"}
    arguments = command("bus", "replay", "-")
    result = subprocess.run(
        arguments, input=b"\xd2\x00\n", capture_output=True, env=strict, timeout=60, check=False
    )
    assert result.returncode == 2
    assert (
        result.stderr.decode().splitlines()[-1].endswith("is not text, so it is not a candump log")
    )
    assert b"Traceback" not in result.stderr


def test_replay_to_a_real_bus_needs_a_confirmation(tmp_path: Path) -> None:
    log = tmp_path / "trip.log"
    log.write_text("(1.0) can0 201#0F00\n")
    for answer in ("", "n\n"):
        told = complaint("replay", log, "--to", "socketcan:no-such-can", stdin=answer)
        assert "nothing was energised" in told
    assert "no-such-can" in complaint("replay", log, "--to", "socketcan:no-such-can", "--yes")
