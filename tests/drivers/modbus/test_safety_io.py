"""The driver of the safety I/O with a simulated device in a separate process."""

from __future__ import annotations

import ctypes
import math
import socket
import time
from collections.abc import Iterator
from pathlib import Path

import pytest
from waiting import until

from cdpr_drivers.modbus.channel import ModbusError
from cdpr_drivers.modbus.safety_io import IoLink, SafetyIo, SafetyIoError
from cdpr_drivers.robot.safety import trip_file
from cdpr_profiles.safety_io import SafetyIoProfile
from cdpr_sim_bus.physics_board import BoardAxis, PhysicsBoard, SafetyIoFault
from tests.drivers.modbus.safety_rig import CLOCK, SafetyIoProcess, io_device_on_board, wait_until

TRIP_S = 0.4
QUICK = {"answer_timeout_s": 0.2, "trip_timeout_s": TRIP_S}
"""Short timeouts, for tests that wait for them."""


def watched(io_device: SafetyIoProcess) -> SafetyIoProfile:
    """Return the profile whose device drops its outputs after a second of silence."""
    whole = io_device.profile()
    assert whole.watchdog is not None
    return io_device.profile(watchdog=whole.watchdog.model_copy(update={"timeout_s": 1.0}))


@pytest.fixture(scope="module")
def lab(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[SafetyIoProcess, PhysicsBoard]]:
    with io_device_on_board(tmp_path_factory.mktemp("safety")) as both:
        yield both


@pytest.fixture
def winch(lab: tuple[SafetyIoProcess, PhysicsBoard]) -> BoardAxis:
    return lab[1].axis(0)


@pytest.fixture
def io_device(
    lab: tuple[SafetyIoProcess, PhysicsBoard], winch: BoardAxis
) -> Iterator[SafetyIoProcess]:
    """Return the device in its initial state, with its winch in the middle."""
    winch.publish(0.0, 0.0, 0.0, 0.0, False)
    lab[0].mend()
    yield lab[0]
    lab[0].mend()


def test_the_contactor_closes_when_asked_and_opens_at_the_end(
    io_device: SafetyIoProcess, winch: BoardAxis
) -> None:
    with SafetyIo(io_device.profile(), CLOCK) as io:
        assert not winch.power_allowed
        assert not io.state.contactor_closed
        io.energise()
        assert winch.power_allowed
        assert not winch.brake_released
        io.release_brakes("winch 1")
        io.await_brakes(True, "winch 1")
        assert winch.brake_released
        assert io.state.brakes_released == {"winch 1": True, "rail 1": False}
        assert (io.alarm(), io.stop_reason()) == ("", "")
        wait_until(lambda: io.state.lights == {"red": False, "yellow": True, "green": False})
    assert not winch.power_allowed
    assert not winch.brake_released
    assert not io_device.coil(0)


def test_the_emergency_stop_trips_until_it_is_acknowledged(
    io_device: SafetyIoProcess, winch: BoardAxis, tmp_path: Path
) -> None:
    latch = tmp_path / "trip.json"
    with SafetyIo(io_device.profile(), CLOCK, latch) as io:
        io.energise()
        io.release_brakes()
        io.await_brakes(True)
        io_device.press()
        wait_until(io.alarm)
        assert "emergency-stop chain is open (input 0 reads 0)" in io.alarm()
        wait_until(lambda: not io_device.coil(0) and not io_device.coil(1))
        wait_until(lambda: not winch.brake_released)
        with pytest.raises(SafetyIoError, match="chain is open"):
            io.acknowledge()
        io_device.press(False)
        CLOCK.sleep(0.1)
        assert io.alarm()  # stays
    with SafetyIo(
        io_device.profile(), CLOCK, latch
    ) as later:  # a second command, after the buttons were released
        with pytest.raises(SafetyIoError, match=r"tripped on .*chain is open.*io ack"):
            later.energise()
        later.acknowledge()
        later.energise()
        assert winch.power_allowed


@pytest.mark.parametrize(
    ("fault", "text"),
    [
        (
            SafetyIoFault.SILENT,
            r"no good poll for \d\.\d+ s, 0\.4 s allowed .*no answer within 0\.2 s",
        ),
        (SafetyIoFault.TRUNCATED, r"no good poll .*the answer was cut off after \d+ bytes"),
        (SafetyIoFault.WRONG_UNIT, r"no good poll .*unit 2 answered, but unit 1 was asked"),
        (SafetyIoFault.EXCEPTIONS, r"no good poll .*refused with exception 4 \(device failure\)"),
    ],
)
def test_invalid_answers_stop_the_motion(
    io_device: SafetyIoProcess, fault: SafetyIoFault, text: str
) -> None:
    io = SafetyIo(io_device.profile(**QUICK), CLOCK).open()
    try:
        io.energise()
        began_s = CLOCK.now_s
        io_device.break_(fault)
        wait_until(io.stop_reason)
        assert CLOCK.now_s - began_s > TRIP_S / 2
        assert not io.alarm()  # a controlled stop: power is not known to be off
        io_device.break_(SafetyIoFault(0))
        CLOCK.sleep(0.1)
        with pytest.raises(SafetyIoError, match=text):
            io.energise()
    finally:
        io_device.break_(SafetyIoFault(0))
        io.close()


def test_a_poll_waiting_for_its_answer_trips_after_the_trip_timeout(
    io_device: SafetyIoProcess,
) -> None:
    """The task waits for the answer much longer than the trip timeout."""
    io = SafetyIo(io_device.profile(trip_timeout_s=TRIP_S), CLOCK).open()
    try:
        io.energise()
        io_device.break_(SafetyIoFault.SILENT)
        wait_until(io.stop_reason)
        assert "no answer has arrived" in io.stop_reason()
    finally:
        io_device.break_(SafetyIoFault(0))
        assert "no good poll" in io.close()


def test_a_pause_of_the_process_does_not_trip_but_silence_after_it_does(
    io_device: SafetyIoProcess,
) -> None:
    hold_interpreter = ctypes.PyDLL(None).usleep  # unlike time.sleep, it blocks all threads
    trip_s = 1.0  # longer than a busy machine delays answers
    with SafetyIo(io_device.profile(answer_timeout_s=0.5, trip_timeout_s=trip_s), CLOCK) as io:
        io.energise()
        assert io.stop_reason() == ""
        hold_interpreter(int(1.5e6 * trip_s))
        assert io.stop_reason() == ""
        asking_s = CLOCK.now_s + 2 * trip_s
        while CLOCK.now_s < asking_s:
            assert io.stop_reason() == ""
            CLOCK.sleep(0.01)
        io_device.break_(SafetyIoFault.SILENT)
        hold_interpreter(int(1.5e6 * trip_s))
        wait_until(io.stop_reason)
        io_device.break_(SafetyIoFault(0))


def test_silence_trips_also_if_cycles_are_longer_than_the_trip_timeout(
    io_device: SafetyIoProcess,
) -> None:
    """Only the first such cycle is excused."""
    with SafetyIo(io_device.profile(**QUICK), CLOCK) as io:
        io.energise()
        io_device.break_(SafetyIoFault.SILENT)
        for _ in range(2):
            CLOCK.sleep(1.5 * TRIP_S)
            io.stop_reason()
        assert "no good poll" in io.stop_reason()
        io_device.break_(SafetyIoFault(0))


def test_a_welded_contactor_is_detected(io_device: SafetyIoProcess) -> None:
    io = SafetyIo(io_device.profile(), CLOCK).open()
    io.energise()
    io_device.break_(SafetyIoFault.CONTACTOR_WELDED)
    assert "the contactor is closed (input 1) although output 0 is 0; is it welded?" in io.close()
    with SafetyIo(io_device.profile(), CLOCK) as io:
        with pytest.raises(SafetyIoError, match="welded"):
            io.energise()
        io_device.break_(SafetyIoFault(0))
        wait_until(lambda: not io.state.contactor_closed)


def test_a_contactor_without_feedback_is_detected(
    io_device: SafetyIoProcess, winch: BoardAxis
) -> None:
    io_device.break_(SafetyIoFault.FEEDBACK_STUCK)
    with SafetyIo(io_device.profile(), CLOCK) as io:
        with pytest.raises(
            SafetyIoError, match=r"contactor is not closed \d\.\d+ s after output 0"
        ):
            io.energise()
        wait_until(lambda: not io_device.coil(0))


def test_an_output_changed_by_another_client_is_detected(io_device: SafetyIoProcess) -> None:
    with SafetyIo(io_device.profile(), CLOCK) as io:
        io.energise()
        io_device.break_(SafetyIoFault.FEEDBACK_STUCK)  # otherwise the feedback would show it
        io_device.set(0, False)
        wait_until(io.alarm)
        assert "output 0 was set to 1 and reads 0" in io.alarm()
        io_device.break_(SafetyIoFault(0))


def test_an_unexpected_error_in_a_poll_trips_and_power_is_cut_at_close(
    io_device: SafetyIoProcess, winch: BoardAxis, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(*_: object) -> None:
        raise KeyError("an input that is nowhere")

    with SafetyIo(io_device.profile(**QUICK), CLOCK) as io:
        io.energise()
        monkeypatch.setattr("cdpr_drivers.modbus.safety_io.interpret", fail)
        wait_until(io.stop_reason)
        assert "an input that is nowhere" in io.stop_reason()
        monkeypatch.undo()
    assert not winch.power_allowed


def test_an_interrupt_of_the_polling_opens_the_contactor(
    io_device: SafetyIoProcess, winch: BoardAxis, monkeypatch: pytest.MonkeyPatch
) -> None:
    def interrupt(*_: object) -> None:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt), SafetyIo(io_device.profile(), CLOCK) as io:
        io.energise()
        with monkeypatch.context() as patch:
            patch.setattr("cdpr_drivers.modbus.safety_io.interpret", interrupt)
            CLOCK.sleep(1.0)
    assert not winch.power_allowed
    assert not io_device.coil(0)


def test_a_loop_busy_for_long_detects_that_the_device_opened_the_contactor(
    io_device: SafetyIoProcess, winch: BoardAxis
) -> None:
    with SafetyIo(watched(io_device), CLOCK) as io:
        io.energise()
        time.sleep(1.3)  # no polls; the device waits for 1 s
        until(lambda: not winch.power_allowed)
        wait_until(io.alarm)
        assert "contactor did not stay closed" in io.alarm()


def test_each_address_has_a_separate_trip_file() -> None:
    here, there = (trip_file(f"modbus-remote-io@10.0.0.{i}:502") for i in (1, 2))
    assert here != there
    assert trip_file("modbus-remote-io@127.0.0.1:502") == trip_file("modbus-remote-io")


def test_a_damaged_trip_file_prevents_power_until_acknowledged(
    io_device: SafetyIoProcess, tmp_path: Path
) -> None:
    latch = tmp_path / "trip.json"
    latch.write_text("{")
    with SafetyIo(io_device.profile(), CLOCK, latch) as io:
        with pytest.raises(SafetyIoError, match="is damaged"):
            io.energise()
        io.acknowledge()
        io.energise()


def test_a_limit_switch_stops_the_motion(io_device: SafetyIoProcess, winch: BoardAxis) -> None:
    with SafetyIo(io_device.profile(), CLOCK) as io:
        io.energise()
        winch.publish(0.0, 0.0, math.radians(91.0), 0.0, True)
        wait_until(io.stop_reason)
        assert "winch 1 stands on its positive limit switch (input 4 reads 0)" in io.stop_reason()
        assert not io.alarm()
        assert winch.power_allowed  # for the controlled stop
        wait_until(lambda: not winch.power_allowed)  # the stop has a time limit
    with (
        SafetyIo(io_device.profile(), CLOCK) as io,
        pytest.raises(SafetyIoError, match="limit switch"),
    ):
        io.energise()


def test_the_device_drops_its_outputs_when_the_master_falls_silent(
    io_device: SafetyIoProcess, winch: BoardAxis
) -> None:
    link = IoLink(watched(io_device), CLOCK)
    link.set_watchdog()
    link.feed_watchdog()
    link.write(0, True)
    wait_until(lambda: winch.power_allowed)
    wait_until(lambda: not winch.power_allowed)
    assert not link.state().contactor_asked
    link.close()


def test_a_missing_silent_or_wrong_device_is_reported(io_device: SafetyIoProcess) -> None:
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
        with pytest.raises(ModbusError, match=rf"127.0.0.1:{port}: cannot connect: Connection ref"):
            SafetyIo(io_device.profile(port=port), CLOCK).open()
        # accepts the connection but does not answer
        free.listen()
        with pytest.raises(ModbusError, match=r"no answer within 0\.2 s from unit 1"):
            SafetyIo(io_device.profile(port=port, **QUICK), CLOCK).open()
    with pytest.raises(ModbusError, match=r"no-such-host\.invalid:\d+: cannot connect"):
        SafetyIo(io_device.profile(host="no-such-host.invalid"), CLOCK).open()
    with pytest.raises(ModbusError, match=r"exception 11 \(gateway target .* is the unit id right"):
        SafetyIo(io_device.profile(unit=9), CLOCK).open()
    assert not io_device.coil(0)
