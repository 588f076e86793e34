"""One suite runs each shipped drive profile on its simulated drive.

The simulated drives take their quirks from the simulator's data. A profile with a wrong unit, sign
or mode fails here when compared with the true motion.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterator
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from profile_rig import DRIVES, PLANT, Motion, bus_name, write_winch

from cdpr_drivers.axes import homing as touch_probe
from cdpr_drivers.cia402 import POWER_OFF, Mode, State, state_of, supported_modes
from cdpr_drivers.errors import DriveFaultError, ModeRefusedError, SdoError
from cdpr_profiles import DriveProfile, load_winch
from cdpr_rt.control.tuning import design_pid
from cdpr_rt.identification.commissioning_results import Paths, recording
from cdpr_rt.identification.rawlog import read_raw_log
from cdpr_rt.loop.engine import RefusedError
from cdpr_tools.commands.drive import info
from cdpr_tools.commission.commissioning import Commissioning, Measurement, both_ways
from cdpr_tools.composition.session import Session, open_bus, open_winch
from cdpr_tools.composition.simulator import OwnSimulator
from cdpr_tools.output import Output
from tests.fault_texts import alarm

# true values of the plant, which the master does not know
TRUE_OVER_NOMINAL, COGGING_NM = 1.04, 0.06
RAD_PER_COUNT = math.tau / 8192
# sin(4 angle + 17 deg), with the index at 123.4 deg
_PHASE_AT_INDEX_DEG = (17.0 + 4 * 123.4 + 180.0) % 360.0 - 180.0
UNITS_NM = {"generic-cia402": 3e-3, "mnm-profile-torque": 1e-3, "parker-compax3-canopen": 3e-3}
PERIOD_S = 1e-3


@dataclass
class BootedDrive:
    """A simulated and booted drive of one type, with its session and motion."""

    name: str
    session: Session
    motion: Motion

    @property
    def drive(self) -> DriveProfile:
        return self.session.winch.drive

    def shown(self, index: int, sub: int = 0) -> int:
        return self.session.network.read_int(self.session.winch.node_id, index, sub)

    def power(self) -> None:
        """Enable the drive in its torque mode."""
        self.session.set_mode(self.drive.mode_torque)
        self.session.enable()


@pytest.fixture(scope="module", params=DRIVES)
def module_drive(
    request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory
) -> Iterator[BootedDrive]:
    folder = tmp_path_factory.mktemp(request.param)
    plant, truth = folder / "plant.toml", folder / "truth.log"
    plant.write_text(PLANT)
    winch = write_winch(folder, request.param)
    with ExitStack() as stack:
        simulator = OwnSimulator(str(winch), bus_name(), plant, truth)
        stack.callback(simulator.stop)
        url = open_bus(simulator.bus)
        session = stack.enter_context(open_winch(load_winch(winch), url, Output(True)))
        yield BootedDrive(request.param, session, Motion(session, truth))


@pytest.fixture
def booted(module_drive: BootedDrive) -> Iterator[BootedDrive]:
    yield module_drive
    session = module_drive.session
    session.reset()
    session.idle(0.3)


def test_a_drive_boots_with_the_values_of_its_profile(booted: BootedDrive) -> None:
    boot, drive = booted.session.boot, booted.drive
    assert (boot.vendor_id, boot.product_code, boot.revision) == (
        drive.vendor_id, drive.product_code, drive.revision,
    )  # fmt: skip
    assert (boot.rated_torque_Nm, boot.counts_per_turn) == (3.0, 8192)
    assert supported_modes(boot.supported_modes) == sorted(drive.supported_modes)
    assert booted.session.network.dictionary(1).device_information.vendor_number == boot.vendor_id


def test_pdos_are_mapped_as_in_the_profile(booted: BootedDrive) -> None:
    assert any(" and " in change for change in booted.session.boot.changed), "no object was mapped"
    for base, pdos in ((0x1400, booted.drive.rpdos), (0x1800, booted.drive.tpdos)):
        for pdo in pdos:
            parameters, mapping = base + pdo.number - 1, base + 0x1FF + pdo.number
            assert booted.shown(parameters, 1) & 0xBFFFFFFF == pdo.cob_id(1)
            assert booted.shown(parameters, 2) == pdo.transmission_type
            mapped = [booted.shown(mapping, i + 1) for i in range(booted.shown(mapping, 0))]
            assert mapped == [entry.mapping for entry in pdo.entries]


def test_each_mode_of_the_profile_is_confirmed(booted: BootedDrive) -> None:
    for mode in booted.drive.supported_modes:
        booted.session.set_mode(mode)
        assert booted.shown(0x6061) == mode


def test_info_reports_values_that_the_drive_has_no_objects_for(
    booted: BootedDrive, capsys: pytest.CaptureFixture[str]
) -> None:
    """Such ratings and modes come from the files."""
    winch = booted.session.winch
    url = str(booted.session.network.url)
    info(winch=winch.reference, bus=url, plant=None, as_json=True)
    told = json.loads(capsys.readouterr().out.splitlines()[-1])
    assert (told["rated_torque_Nm"], told["encoder_counts_per_turn"]) == (3.0, 8192)
    assert [int(name.split()[0]) for name in told["supported_modes"]] == sorted(
        booted.drive.supported_modes
    )
    assert told["profile_fits"] is True


def test_unsupported_modes_are_rejected_by_master_and_drive(booted: BootedDrive) -> None:
    foreign = sorted({*range(1, 11)} - {*booted.drive.supported_modes})
    assert foreign
    booted.session.set_mode(Mode.HOMING)
    for mode in foreign:
        with pytest.raises(ModeRefusedError, match="not among the modes the drive supports"):
            booted.session.set_mode(mode)
        with pytest.raises(SdoError, match="cannot be set"):
            booted.session.network.write(1, 0x6060, 0, mode)
        assert booted.shown(0x6061) == Mode.HOMING


def test_a_drive_is_enabled_and_disabled(booted: BootedDrive) -> None:
    booted.power()
    assert booted.session.device.states() == [State.OPERATION_ENABLED]
    assert booted.shown(0x6061) == booted.drive.mode_torque
    assert state_of(booted.shown(0x6041)) == State.OPERATION_ENABLED
    with pytest.raises(RefusedError, match="cycles do not stop in state active"):
        booted.session.set_mode(Mode.HOMING)
    assert booted.session.device.states() == [State.OPERATION_ENABLED]
    booted.session.disable()
    assert state_of(booted.shown(0x6041)) in POWER_OFF


@pytest.mark.parametrize("torque_Nm", [0.6, -0.6])
def test_a_torque_acts_with_the_commanded_sign_and_magnitude(
    booted: BootedDrive, torque_Nm: float
) -> None:
    booted.power()
    device = booted.session.device
    before = float(device.feedback.position_rad[0])
    true = booted.motion.push(torque_Nm, 14)
    steady = true["motor_Nm"][8:14]
    assert steady == pytest.approx(torque_Nm * TRUE_OVER_NOMINAL, rel=0.01)
    assert np.sign(true["velocity"][-1]) == np.sign(torque_Nm)
    assert abs(true["velocity"][-1]) > 20.0
    # the reported values agree with the truth
    moved = float(device.feedback.position_rad[0]) - before
    now = booted.motion.truth(device.feedback.cycle, device.feedback.cycle)
    assert moved == pytest.approx(now["angle"][0] - true["angle"][0], abs=4 * RAD_PER_COUNT)


def test_torques_are_sent_and_reported_in_steps_of_the_drive(booted: BootedDrive) -> None:
    booted.power()
    device = booted.session.device
    wanted, sent, told = 0.0437, [], []
    for _ in range(400):
        device.sync()
        device.receive()
        device.command.torque_Nm[:] = wanted
        device.transmit()
        sent.append(float(device.command.sent_torque_Nm[0]))
        told.append(float(device.feedback.torque_Nm[0]))
    unit = UNITS_NM.get(booted.name, abs(device.axes[0].Nm_per_unit))
    booted.motion.give_back()
    steps = np.array(sent) / unit
    assert steps == pytest.approx(np.round(steps), abs=1e-9)
    assert np.ptp(np.round(steps)) == 1
    assert np.mean(sent) == pytest.approx(wanted, abs=unit / 300)
    assert np.mean(told[50:]) == pytest.approx(wanted, abs=unit / 4)


@pytest.mark.parametrize(("method", "way"), [(34, 1), (33, -1)])
def test_homing_moves_in_the_requested_direction_and_finds_the_index(
    booted: BootedDrive, method: int, way: int
) -> None:
    device = booted.session.device
    booted.power()
    booted.motion.push(-way * 0.6, 14)  # away from the index that an earlier test found
    booted.session.idle(0.3)
    booted.session.disable()
    first = device.feedback.cycle + 1
    booted.session.find_index(method)
    true = booted.motion.truth(first, device.feedback.cycle)
    travelled = way * (true["angle"] - true["angle"][0])
    assert travelled[-1] > 0.3
    assert travelled.min() > -0.02
    speed = np.median(true["velocity"][200:-50])
    assert speed == pytest.approx(way * math.radians(30.0), rel=0.05)
    # 360 deg/s2: 70 ms from a fifteenth to nine tenths of the speed, with the help of cogging
    begun, there = (np.argmax(way * true["velocity"] > v * math.radians(30)) for v in (1 / 15, 0.9))
    assert 50 < there - begun < 300
    assert device.feedback.index_known.all()
    _index_is_right(booted)


def _index_is_right(booted: BootedDrive) -> None:
    """Compare the master's angle from the index with the truth."""
    feedback = booted.session.device.feedback
    now = booted.motion.truth(feedback.cycle, feedback.cycle)
    known = float(feedback.position_rad[0] - feedback.index_rad[0])
    error = (known - float(now["from_index"][0]) + math.pi) % math.tau - math.pi
    assert abs(error) < 4 * RAD_PER_COUNT


def test_touch_probe_finds_the_index_in_motion(booted: BootedDrive) -> None:
    session, device = booted.session, booted.session.device
    if not any(entry.index == 0x60B9 for pdo in booted.drive.tpdos for entry in pdo.entries):
        with pytest.raises(DriveFaultError, match=r"60B8h is not in its EDS.*by homing"):
            touch_probe.arm(*device.group_of(0))
        return
    booted.power()
    session.expect_index()
    assert not device.feedback.index_known[0]
    booted.motion.push(0.6, 20)  # by more than a turn from any rotor angle
    session.idle(0.3)
    assert device.feedback.index_known[0]
    _index_is_right(booted)


def test_quick_stop_brings_the_rotor_to_rest(booted: BootedDrive) -> None:
    booted.power()
    device = booted.session.device
    speed = booted.motion.push(0.6, 14)["velocity"][-1]
    assert speed > 20.0
    booted.motion.push(0.6, 14)
    device.request(State.QUICK_STOP)
    begin = device.feedback.cycle
    booted.session.wait(
        lambda: device.reached(State.SWITCH_ON_DISABLED), 1.0, "the end of a quick stop"
    )
    end = device.feedback.cycle
    assert abs(booted.motion.truth(end, end)["velocity"][0]) < 1.0
    assert end - begin < 500


def test_a_fault_removes_torque_and_remains_until_acknowledged(booted: BootedDrive) -> None:
    booted.power()
    device = booted.session.device
    true = booted.motion.push(2.8, 8)
    assert max(true["motor_Nm"]) > 2.0
    assert device.states() == [State.FAULT]
    assert "2310h" in alarm(device)
    now = booted.motion.truth(device.feedback.cycle, device.feedback.cycle)
    assert now["motor_Nm"][0] == pytest.approx(0.0, abs=1e-6)
    with pytest.raises(DriveFaultError, match="acknowledge its fault"):
        device.request(State.OPERATION_ENABLED)
    booted.session.reset()
    assert booted.shown(0x603F) == 0
    booted.power()
    assert booted.motion.push(0.6, 14)["motor_Nm"][8:14] == pytest.approx(0.624, rel=0.01)


def test_a_silent_master_makes_the_drive_remove_torque(booted: BootedDrive) -> None:
    booted.power()
    booted.motion.push(0.05, 50)  # too little to turn the rotor
    clock = booted.session.network.clock
    deadline_s = clock.now_s + 5.0
    while state_of(booted.shown(0x6041)) not in POWER_OFF:
        assert clock.now_s < deadline_s
        clock.sleep(0.02)
    assert "8130h" in alarm(booted.session.device)
    booted.session.network.start(
        booted.session.winch.node_id
    )  # CiA 301, 1029h: the drive had left operational


def test_a_sweep_measures_the_cogging(booted: BootedDrive, tmp_path: Path) -> None:
    session, paths = booted.session, Paths(tmp_path)
    (tmp_path / "raw").mkdir()
    Commissioning(session, Output(True), paths).prepare()
    inertia = session.winch.motor.rotor_inertia_kg_m2
    design = design_pid(inertia, session.winch.latency_s, 25.0, PERIOD_S)
    session.enable()
    passes = both_ways(math.radians(60.0), 0.5 * math.pi, 1)
    recorded = Measurement(session, Output(True), paths).track("sweep", design, None, passes)
    # half the sum of both directions cancels friction, which changes sign with the motion
    orders = np.arange(1, 13)
    waves = np.mean([_waves(path, orders) for path in recorded], axis=0)
    amplitudes = np.abs(waves)
    assert orders[np.argmax(amplitudes)] == 4
    # in the drive's torque, which is smaller by the factor of the true torque constant
    assert amplitudes[3] == pytest.approx(COGGING_NM / TRUE_OVER_NOMINAL, rel=0.05)
    assert max(np.delete(amplitudes, 3)) < 0.1 * amplitudes[3]
    assert math.degrees(np.angle(waves[3])) == pytest.approx(_PHASE_AT_INDEX_DEG, abs=4.0)


def _waves(path: Path, orders: NDArray[np.int64]) -> NDArray[np.complex128]:
    """Return complex amplitudes of the torque of a recorded pass over the angle from the index."""
    found = recording(read_raw_log(path))
    angle, torque = found.sweep.angle_rad[found.judged], found.sweep.torque_Nm[found.judged]
    turning = np.outer(angle, orders)
    columns = np.hstack([np.ones((angle.size, 1)), np.sin(turning), np.cos(turning)])
    solution = np.linalg.lstsq(columns, torque, rcond=None)[0]
    return np.asarray(solution[1 : orders.size + 1] + 1j * solution[orders.size + 1 :])
