"""Each fault of the table changes the truth or the bus as its row says, until it is mended."""

from __future__ import annotations

import struct
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from cdpr_profiles import load_winch
from cdpr_sim_bus.cia402.drive import SimDrive, transmission_of
from cdpr_sim_bus.cia402.faults import FAULTS
from cdpr_sim_bus.physics_board import PhysicsBoard
from cdpr_sim_bus.robot.cable_robot import CableRobot
from cdpr_sim_bus.robot.plant import Plant
from cdpr_sim_bus.robot.platform import RobotShape
from cdpr_sim_bus.robot.robot_plant import RobotPlant
from tests.sim_bus.cia402.drive_rig import NODE, Rig

TPDO, HEARTBEAT = 0x180 + NODE, 0x700 + NODE
GUIDE = Path(__file__).parents[3] / "docs" / "how-to" / "simulating-faults.md"
ANCHORED = {"kind": "fixed_anchor", "pretension_N": 30.0}


def frames(rig: Rig, cob_id: int, cycles: int = 1) -> list[bytes]:
    """Return the data of the frames with this identifier in some cycles."""
    sent = [frame for _ in range(cycles) for frame in rig.cycle()]
    return [data for identifier, data in sent if identifier == cob_id]


def turned(rig: Rig, cycles: int = 20) -> float:
    """Return by how much the rotor turns under a torque."""
    before, rig.torque = rig.truth[0], 300
    rig.cycles(cycles)
    rig.torque = 0
    return abs(rig.truth[0] - before)


def true_torque(rig: Rig, units: int) -> float:
    """Return the true torque after a time with this target."""
    rig.torque = units
    rig.cycles(20)
    torque: float = rig.drive.truth()["torque_Nm"]
    return torque


def miscount(rig: Rig) -> float:
    rig.cycles(3)
    return abs(rig.position - rig.truth[0] * 8192 / (2.0 * np.pi))


def counted(rig: Rig) -> int:
    """Return by how much the encoder counts while the rotor turns."""
    rig.cycle()
    before = rig.position
    assert turned(rig) > 0.1
    return abs(rig.position - before)


def noise(rig: Rig) -> float:
    rig.cycles(10)
    positions = [struct.unpack_from("<Hi", data)[1] for data in frames(rig, TPDO, 40)]
    return float(np.std(positions))


def indices(rig: Rig) -> bool:
    """Return whether an index pulse came in a few turns."""
    motor = rig.drive.axis.motor
    before = int(motor["rise_count"][0])
    assert turned(rig, 150) > 4.0 * np.pi
    return int(motor["rise_count"][0]) != before


def shown(rig: Rig) -> bool:
    """Return whether the TPDO shows what the drive measures."""
    (data,) = frames(rig, TPDO)
    od = rig.drive.od
    return data == struct.pack("<Hih", *(od.get_int(i) for i in (0x6041, 0x6064, 0x6077)))


def obeys(rig: Rig) -> bool:
    rig.word = 0
    rig.cycles(3)
    return not rig.drive.truth()["power_on"]


def state(key: str, value: object) -> Callable[[Rig], bool]:
    def matches(rig: Rig) -> bool:
        rig.run(0.05)
        return bool(rig.drive.truth()[key] == value)

    return matches


def absent(rig: Rig) -> bool:
    return not frames(rig, TPDO, 3)


BROKEN: dict[str, Callable[[Rig], bool]] = {
    "drive-off": absent,
    "drive-reboot": state("nmt", "pre_operational"),
    "drive-fault": state("state", "fault"),
    "power-lost": lambda rig: not rig.drive.state_machine.power_allowed,
    "pre-operational": state("nmt", "pre_operational"),
    "nmt-stop": state("nmt", "stopped"),
    "commands-ignored": lambda rig: not obeys(rig),
    "torque-bias": lambda rig: true_torque(rig, 300) > 1.2,
    "torque-limit": lambda rig: true_torque(rig, 300) < 0.5,
    "encoder-jump": lambda rig: miscount(rig) > 300,
    "encoder-frozen": lambda rig: counted(rig) == 0,
    "encoder-noise": lambda rig: noise(rig) > 5.0,
    "index-missed": lambda rig: not indices(rig),
    "silence": absent,
    "bus-off": absent,
    "bus-lost": absent,
    "frames-lost": lambda rig: not frames(rig, TPDO),
    "frames-lossy": lambda rig: len(frames(rig, TPDO, 100)) < 98,
    "frames-doubled": lambda rig: len(frames(rig, TPDO)) == 2,
    "frames-late": lambda rig: [len(frames(rig, TPDO)) for _ in "ab"] == [0, 2],
    "frames-corrupted": lambda rig: not shown(rig),
    "duplicate-node": lambda rig: len(set(frames(rig, HEARTBEAT, 50))) == 2,
    "no-heartbeat": lambda rig: not frames(rig, HEARTBEAT, 50),
    "heartbeat-late": lambda rig: not frames(rig, HEARTBEAT, 50),
    "emcy": lambda rig: bool(rig.collect() is not None and (0xFF00, 0x81) in rig.emergencies),
    "emcy-flood": lambda rig: len(frames(rig, 0x080 + NODE, 5)) >= 5,
    "cut-cable": state("tension_N", 0.0),
    "slip": state("cable", "slipped"),
    "caught-cable": lambda rig: turned(rig) == 0.0,
    "brake-worn": lambda rig: turned(rig) > 0.1,
    "brake-stuck": lambda rig: turned(rig) == 0.0,
}
"""For each fault of a drive, whether it is there."""


@pytest.mark.parametrize("name", BROKEN)
def test_a_fault_of_a_drive_shows_until_it_is_mended(name: str) -> None:
    fault, broken = FAULTS[name], BROKEN[name]
    rig = Rig(Plant.model_validate({"load": ANCHORED if name in ("cut-cable", "slip") else {}}))
    if name == "caught-cable":
        rig.drive.axis.plant = Plant.model_validate({"load": ANCHORED})
    rig.map_pdos()
    rig.write(0x1017, 10)
    rig.enable(10)
    axis, injection = rig.drive.axis, rig.drive.fault_injection
    axis.brake_applied = name in ("torque-bias", "torque-limit", "brake-worn", "encoder-noise")
    axis.update_brake()
    if not fault.lasts:
        assert not broken(rig)
    injection.apply(fault, fault.amount(None))
    assert broken(rig)
    if fault.lasts and fault.left is None:
        assert injection.broken() == {name: fault.usual}
    if not fault.lasts:
        return
    injection.apply(fault, 0)
    assert injection.broken() == {}
    rig.run(0.02)
    if name in ("drive-off", "bus-off"):  # it waits for its master
        rig.nmt(1)
    if name == "cut-cable":  # mended with its slack
        assert rig.drive.truth()["cable"] == "intact"
        return
    assert not broken(rig)


def test_a_stuck_torque_outlasts_its_command() -> None:
    rig = Rig()
    rig.map_pdos()
    rig.enable(10)
    rig.drive.axis.brake_applied = True
    rig.drive.axis.update_brake()
    whole = true_torque(rig, 300)
    rig.drive.fault_injection.apply(FAULTS["torque-stuck"], 1)
    assert true_torque(rig, 0) == pytest.approx(whole, abs=0.05)
    rig.word = 0
    assert true_torque(rig, 0) == pytest.approx(0.0, abs=1e-6), "without power there is no torque"
    rig.drive.fault_injection.apply(FAULTS["torque-stuck"], 0)
    rig.enable(10)
    assert true_torque(rig, 0) == pytest.approx(0.0, abs=0.05)


def test_a_load_cell_shows_more_than_the_tension(tmp_path: Path) -> None:
    rig = Rig(Plant.model_validate({"load": ANCHORED}))
    with PhysicsBoard.create(tmp_path / "board", 1) as board:
        rig.drive.connect(board.axis(0))
        for amount in (40, 0):
            rig.drive.fault_injection.apply(FAULTS["cell-off"], amount)
            rig.run(0.01)
            shown_N = board.axis(0).state().tension_N
            assert shown_N - rig.drive.truth()["tension_N"] == pytest.approx(amount)


@contextmanager
def bodies(planar: bool) -> Iterator[tuple[CableRobot, list[SimDrive], Callable[[float], None]]]:
    """A platform in a plane or in space, its drives, and a function that lets time pass."""
    winch, plant = load_winch("winch-mpp0923d"), RobotPlant()
    exits = np.array([[0.0, 3.0, 0.0], [4.0, 3.0, 0.0], [2.0, 0.0, 0.0]])
    anchors = np.array([[-0.05, 0.05, 0.0], [0.05, 0.05, 0.0], [0.0, -0.05, 0.0]])
    if not planar:
        exits[2, 2] = 2.0
    k = 2 if planar else 3
    shape = RobotShape(exits[:, :k], anchors[:, :k], 4.0, (2.0, 1.3, 0.0)[:k], [0.1] * 3)
    body = CableRobot(shape, plant, [transmission_of(winch)] * 3)
    plants = plant.motor_plants(3, [winch] * 3)
    drives = [
        SimDrive.for_winch(replace(winch, node_id=i + 1), own, robot=member)
        for i, (own, member) in enumerate(zip(plants, body.members(), strict=True))
    ]
    now = 0.0

    def run(seconds: float) -> None:
        nonlocal now
        for _ in range(round(seconds * 1000)):
            now += 1e-3
            for drive in drives:
                drive.advance(now)
                drive.outbox.clear()

    run(0.05)
    yield body, drives, run
    for drive in drives:
        drive.close()


@pytest.mark.parametrize("k", [0, 1, 2])
def test_a_hand_pushes_the_platform_until_mended(k: int) -> None:
    with bodies(planar=False) as (body, drives, run):
        injection, fault = drives[0].fault_injection, FAULTS[("push-x", "push-y", "push-z")[k]]
        injection.apply(fault, 500)
        run(0.03)
        moved = body.velocity_m_s
        assert moved[k] > 1.0 and abs(np.delete(moved, k)).max() < 0.5
        injection.apply(fault, 0)
        before = body.velocity_m_s
        run(0.01)
        assert abs(body.velocity_m_s - before).max() < 0.5


def test_an_obstacle_holds_the_platform_and_a_payload_weighs_on_it() -> None:
    with bodies(planar=True) as (body, drives, run):
        injection = drives[0].fault_injection
        start = body.position_m
        assert not injection.has("space")
        injection.apply(FAULTS["obstacle"], 50.0)
        injection.apply(FAULTS["push-y"], 500.0)
        run(0.1)
        assert 0.001 < body.position_m[1] - start[1] < 0.015
        injection.apply(FAULTS["obstacle"], 0)
        run(0.1)
        assert body.position_m[1] - start[1] > 0.05
        injection.apply(FAULTS["push-y"], 0)
        injection.apply(FAULTS["payload"], 2.0)
        assert injection.broken() == {"payload": 2.0}
        injection.apply(FAULTS["put-back"], 1)
        assert body.position_m == pytest.approx(start, abs=0.01)
        assert body.platform["mass"][0] == pytest.approx(6.0)
        injection.apply(FAULTS["payload"], 0)
        assert body.platform["mass"][0] == pytest.approx(4.0)


def test_the_guide_describes_every_fault_with_its_usual_amount() -> None:
    rows = [line for line in GUIDE.read_text().splitlines() if line.startswith("| `")]
    for name, fault in FAULTS.items():
        (row,) = [row for row in rows if f"`{name}`" in row]
        assert fault.unit in ("", "code") or f"{fault.usual:g} {fault.unit}" in row, row
