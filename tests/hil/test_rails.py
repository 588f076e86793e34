"""Commands that move rails: rejected moves and interrupted moves."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
import uuid
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from rails_rig import ANSWER_S, MASTER_S, Rails, another_winch, patient_rail
from typer.testing import CliRunner

sys.path.insert(0, str(Path(__file__).parents[1] / "drivers" / "modbus"))
from safety_rig import CLOCK, SafetyIoProcess, board_file, patient_profile, ready, start, wait_until

from cdpr_drivers.modbus.safety_io import SafetyIoError
from cdpr_drivers.robot.rail import Cia402RailAxis, ModbusRailAxis, RailError
from cdpr_profiles.rail import load_rail
from cdpr_sim_bus.devices.sim_rail import RailFault
from cdpr_sim_bus.physics_board import PhysicsBoard, SafetyIoFault
from cdpr_tools import cli
from cdpr_tools.commands import rail as rail_commands
from cdpr_tools.errors import BAD_INPUT, BadInputError

FAILED = 1


@pytest.fixture(scope="module")
def parts(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Rails]:
    folder = tmp_path_factory.mktemp("rails")
    bus = f"simbus:rails-{os.getpid()}-{uuid.uuid4().hex[:6]}"
    cia402, modbus = (patient_rail(folder, kind) for kind in ("cia402", "modbus"))
    with board_file() as on_rail, board_file() as on_winch:
        drive = start("rail", cia402, "--bus", bus, "--board", on_rail)
        other = start("rail", modbus, "--port", "0")
        with PhysicsBoard.create(on_winch, 1) as winch:
            ready(drive)
            cells = start("tension", "rtu-load-cell-1", "--board", on_winch)
            port = int(ready(other)["port"])
            modbus = patient_rail(folder, "modbus", port)
            io_device = SafetyIoProcess(
                patient_profile(folder, 3.0 * MASTER_S, ANSWER_S, ANSWER_S, ANSWER_S),
                *("--board", on_winch, "--board", on_rail),
            )
            with PhysicsBoard.attach(on_rail) as rail:
                tty = ready(cells)["port"]
                axes, home = (winch.axis(0), rail.axis(0)), folder / "state"
                yield Rails(bus, io_device, *axes, cia402, modbus, port, tty, home)
            io_device.close()
            for process in (drive, other, cells):
                process.communicate(b"", timeout=120)


@pytest.fixture
def rails(parts: Rails) -> Rails:
    parts.pull(0.0)
    parts.io_device.mend()
    parts.break_modbus(RailFault(0))
    parts.forget()
    return parts


def await_motion(rails: Rails, kind: str, command: subprocess.Popen[str], past_m: float) -> None:
    def moves() -> bool:
        assert command.poll() is None, command.communicate()[1]
        return rails.position_m(kind) > past_m

    wait_until(moves)


def result(command: subprocess.Popen[str], status: int = 0) -> dict[str, Any]:
    out, errors = command.communicate(timeout=120)
    assert "Traceback" not in errors + out, errors
    assert command.returncode == status, errors
    told: dict[str, Any] = json.loads(out.splitlines()[-1])
    return told


@pytest.mark.parametrize("kind", ["cia402", "modbus"])
def test_a_move_arrives_and_invalidates_the_calibration(rails: Rails, kind: str) -> None:
    target = rails.position_m(kind) + 0.01
    told = result(rails.move(kind, target))
    assert abs(rails.position_m(kind) - target) < 5e-4
    assert abs(told["to_m"] - target) < 5e-4 and told["brake_moved_m"] < 2e-4
    assert rails.braked(kind)
    state = rails.calibration()
    assert state["calibrated"] is False and "was moved from" in state["why"]


@pytest.mark.parametrize("meanwhile", ["nothing", "Ctrl-C", "power"])
def test_conditions_of_a_move_are_checked_again_after_a_slow_disk_write(
    rails: Rails, monkeypatch: pytest.MonkeyPatch, meanwhile: str
) -> None:
    def slow(_fd: int) -> None:  # simulates a busy disk
        if meanwhile == "Ctrl-C" and not written:
            os.kill(os.getpid(), signal.SIGINT)
        if meanwhile == "power":
            power()
        written.append(_fd)
        # longer than the timeouts of drives for their master and of questions to winches
        time.sleep(1.5 * MASTER_S)

    def enable(axis: Cia402RailAxis) -> None:
        enabled.append(axis)
        really_enable(axis)

    enabled, really_enable, written = list[Cia402RailAxis](), Cia402RailAxis.enable, list[int]()
    monkeypatch.setattr(Cia402RailAxis, "enable", enable)
    before = rails.position_m("cia402")
    with another_winch() as (bus, power):
        monkeypatch.setattr(os, "fsync", slow)
        slack = ("--cables-slack-checked", "--winch-bus", bus)
        outcome = rails.moved("cia402", before + 0.005, *slack)
    moved_m = rails.position_m("cia402") - before
    if meanwhile == "nothing":
        assert outcome.exit_code == 0, outcome.exception
        assert abs(moved_m - 0.005) < 5e-4
        return
    why = (
        f"moves only without power at the winches: node 1 on {bus} is"
        if meanwhile == "power"
        else ""
    )
    said = str(outcome.exception)
    assert (why or "stopped on request") in said
    assert said.endswith("; the robot is no longer calibrated")
    assert abs(moved_m) < 2e-4 and rails.braked("cia402")  # play of the brake
    assert not enabled


def test_a_stop_before_the_carriage_moves_keeps_the_calibration(
    rails: Rails, monkeypatch: pytest.MonkeyPatch
) -> None:
    def push(axis: Cia402RailAxis, share: float) -> bool:
        if not pushed:
            os.kill(os.getpid(), signal.SIGINT)
        pushed.append(share)
        return really_push(axis, share)

    pushed, really_push = list[float](), Cia402RailAxis.push
    monkeypatch.setattr(Cia402RailAxis, "push", push)
    error = rails.refused("cia402", rails.position_m("cia402") + 0.3)
    assert error.endswith("stopped on request") and pushed
    assert rails.calibration()["calibrated"] is True and rails.braked("cia402")


@pytest.mark.parametrize("kind", ["cia402", "modbus"])
def test_a_brake_that_does_not_hold_is_detected_before_the_move(rails: Rails, kind: str) -> None:
    before = rails.position_m(kind)
    rails.wear_brake(kind)
    error = rails.refused(kind, before + 0.3)
    assert "the applied brake does not hold: with 10 % of the rated torque" in error
    assert abs(rails.position_m(kind) - before) < 0.05
    assert "slipped by" in rails.calibration()["why"]


@pytest.mark.parametrize(
    ("fault", "said"),
    [
        (RailFault.TARGET_LOST, "holding register 100 was set to"),
        (RailFault.DRIVE_FAULT, "the drive is in fault"),
        (RailFault.BRAKE_STUCK, f"the brake is not released {ANSWER_S:g} s after the command"),
        (RailFault.TRUNCATED, "the answer was cut off after"),
        (RailFault.SILENT, f"no answer within {ANSWER_S:g} s from unit 1"),
    ],
)
def test_a_drive_that_does_not_follow_commands_is_not_moved(
    rails: Rails, fault: RailFault, said: str
) -> None:
    before = rails.position_m("modbus")
    rails.break_modbus(fault)
    error = rails.refused("modbus", 0.9)
    rails.break_modbus(RailFault(0))
    assert said in error
    assert rails.position_m("modbus") == before


@pytest.mark.alone  # load cells and their reader follow the wall clock
def test_tight_cables_prevent_or_end_a_move(rails: Rails) -> None:
    before = rails.position_m("cia402")
    cells = ("--sensors", "rtu-load-cell-1", "--tension-port", rails.tension_port)
    rails.pull(40.0)
    error = rails.refused("cia402", before + 0.3, *cells)
    assert "moves only with slack cables: winch 1 has 4" in error
    assert "(5 N allowed)" in error
    assert abs(rails.position_m("cia402") - before) < 1e-4
    assert rails.calibration()["calibrated"] is True
    rails.pull(0.0)
    command = rails.move("cia402", before + 0.5, *cells)
    await_motion(rails, "cia402", command, before + 0.01)
    rails.pull(40.0)
    assert "the cables are no longer slack" in result(command, FAILED)["error"]
    assert rails.braked("cia402")
    assert before + 0.01 < rails.position_m("cia402") < before + 0.3


def test_a_winch_with_power_prevents_or_ends_a_move(rails: Rails) -> None:
    before = rails.position_m("modbus")
    with another_winch() as (bus, power):
        slack = ("--cables-slack-checked", "--winch-bus", bus)
        command = rails.move("modbus", before + 0.5, *slack)
        await_motion(rails, "modbus", command, before + 0.005)
        power()
        error = result(command, FAILED)["error"]
        assert f"a winch may have power: node 1 on {bus} is" in error
        assert rails.braked("modbus")
        assert rails.position_m("modbus") < before + 0.4
        before = rails.position_m("modbus")
        error = rails.refused("modbus", before + 0.1, *slack)
        assert f"moves only without power at the winches: node 1 on {bus} is" in error
        assert rails.position_m("modbus") == before


def test_a_modbus_rail_obeys_the_safety_io_and_only_one_command(rails: Rails) -> None:
    before = rails.position_m("modbus")
    slack = ("--cables-slack-checked", "--safety-io", rails.io_device.reference)
    command = rails.move("modbus", before + 0.5, *slack)
    await_motion(rails, "modbus", command, before + 0.005)
    with pytest.raises(RailError, match="already enabled: wait until the command"):
        ModbusRailAxis(load_rail(rails.modbus), CLOCK).open()
    rails.io_device.press()
    assert "the emergency-stop chain is open" in result(command, FAILED)["error"]
    assert rails.braked("modbus")
    rails.io_device.press(False)
    rails.acknowledge_trip()


def test_naming_a_simulated_bus_does_not_replace_the_confirmation_for_a_real_rail(
    rails: Rails,
) -> None:
    arguments = ["move", str(rails.modbus), "--to", "0.9", "--cables-slack-checked"]
    outcome = CliRunner().invoke(rail_commands.app, [*arguments, "--bus", rails.bus])
    assert isinstance(outcome.exception, BadInputError)
    assert "not confirmed" in str(outcome.exception)


@pytest.mark.parametrize("kind", ["cia402", "modbus"])
def test_an_interrupted_move_stops_brakes_and_invalidates_the_calibration(
    rails: Rails, kind: str
) -> None:
    before = rails.position_m(kind)
    command = rails.move(kind, before + 0.5)
    await_motion(rails, kind, command, before + 0.005)
    command.send_signal(signal.SIGINT)
    assert "stopped on request" in result(command, FAILED)["error"]
    assert rails.braked(kind)
    assert rails.position_m(kind) < before + 0.4
    assert rails.calibration()["calibrated"] is False


def test_an_interrupted_move_comes_to_rest_before_it_is_braked(
    rails: Rails, monkeypatch: pytest.MonkeyPatch
) -> None:
    before, speeds = rails.position_m("cia402"), list[float]()

    def arrived(axis: Cia402RailAxis) -> bool:
        if not speeds and rails.position_m("cia402") > before + 0.005:
            speeds.append(rails.speed_m_s())
            os.kill(os.getpid(), signal.SIGINT)
        return really_arrived(axis)

    def set_brake(axis: Cia402RailAxis, released: bool) -> None:
        if speeds and not released:
            speeds.append(rails.speed_m_s())
        really_set_brake(axis, released)

    really_arrived, really_set_brake = Cia402RailAxis.arrived, Cia402RailAxis.set_brake
    monkeypatch.setattr(Cia402RailAxis, "arrived", arrived)
    monkeypatch.setattr(Cia402RailAxis, "set_brake", set_brake)
    assert "stopped on request" in rails.refused("cia402", before + 0.5)
    in_motion, *braked = map(abs, speeds)
    assert in_motion > 0.8 * 0.05 and max(braked) < 0.2 * 0.05  # share of the move's speed


@pytest.mark.parametrize("kind", ["cia402", "modbus"])
def test_a_rail_stops_after_its_command_was_killed(rails: Rails, kind: str) -> None:
    before = rails.position_m(kind)
    command = rails.move(kind, before + 0.5)
    await_motion(rails, kind, command, before + 0.005)
    command.kill()
    command.communicate()
    if kind == "cia402":  # the drive misses the master before the I/O does
        wait_until(lambda: abs(rails.rail.state().motor_rad_s) < 0.05)
        assert rails.rail.brake_released
    wait_until(lambda: rails.braked(kind))
    assert rails.position_m(kind) < before + 0.4
    assert rails.calibration()["calibrated"] is False


def test_a_silent_safety_io_ends_a_move(rails: Rails) -> None:
    before = rails.position_m("cia402")
    command = rails.move("cia402", before + 0.3)
    await_motion(rails, "cia402", command, before + 0.005)
    rails.io_device.break_(SafetyIoFault.SILENT)
    assert "no good poll" in result(command, FAILED)["error"]
    assert rails.position_m("cia402") < before + 0.2
    assert not rails.rail.state().power_on
    rails.acknowledge_trip()


def test_the_emergency_stop_ends_a_move(rails: Rails) -> None:
    before = rails.position_m("cia402")
    command = rails.move("cia402", before + 0.5)
    await_motion(rails, "cia402", command, before + 0.005)
    rails.io_device.press()
    wait_until(lambda: rails.braked("cia402"))
    assert "the emergency-stop chain is open" in result(command, FAILED)["error"]
    rails.io_device.press(False)
    on = ["--bus", rails.bus, "--safety-io", rails.io_device.reference]
    where = ["reset", str(rails.cia402), *on]
    runner = CliRunner(env={"XDG_STATE_HOME": str(rails.home)})
    with pytest.raises(SafetyIoError, match="tripped on"):
        runner.invoke(rail_commands.app, where, catch_exceptions=False)
    rails.acknowledge_trip()
    assert "no fault" in runner.invoke(rail_commands.app, where, catch_exceptions=False).stdout


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("--to", "1.5", "--cables-slack-checked"), "--to 1.5: allowed: 0 to 1.2 m"),
        (("--to", "0.1", "--safety-io", "nobody"), "the cables must be slack"),
        (("--to", "0.1", "--cables-slack-checked"), "--safety-io: Rail 1"),
        (
            ("--to", "0.1", "--safety-io", "nobody", "--sensors", "rtu-load-cell-1"),
            "--tension-port",
        ),
    ],
)
def test_missing_requirements_of_a_move_are_reported_before_it_starts(
    arguments: tuple[str, ...], said: str
) -> None:
    command = ["move", "rail-cia402", "--bus", "simbus:nobody", *arguments]
    outcome = CliRunner().invoke(rail_commands.app, command)
    assert cli.exit_status(outcome.exception) == BAD_INPUT
    assert said in str(outcome.exception)
