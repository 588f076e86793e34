"""The simulated parts of a robot: drives, cables, platform and logs, and their true geometry."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from numpy.typing import NDArray

from cdpr_profiles import Robot, Winch
from cdpr_profiles.errors import ProfileError
from cdpr_profiles.platform import Platform
from cdpr_sim_bus.canopen.store import StoreError
from cdpr_sim_bus.cia402.drive import SimDrive, transmission_of
from cdpr_sim_bus.frame import FrameLog
from cdpr_sim_bus.physics_board import PhysicsBoard
from cdpr_sim_bus.robot.cable_robot import CableRobot
from cdpr_sim_bus.robot.motor_state import Transmission
from cdpr_sim_bus.robot.plant import Plant
from cdpr_sim_bus.robot.platform import RobotShape
from cdpr_sim_bus.robot.robot_plant import RobotPlant
from cdpr_sim_bus.robot.truth_log import BoardPose, MotorsLog, PoseLog, PoseScanner
from cdpr_tools.composition.simulator import OwnCamera
from cdpr_tools.errors import BadInputError, os_error_as, raised_as


def simulated_drives(
    stack: ExitStack,
    robot: Robot,
    plant: Path | None,
    *,
    detached: bool = False,
    store: Path | None = None,
    truth_log: Path | None = None,
    scanner: Path | None = None,
    board: Path | None = None,
    camera: Path | None = None,
    lockstep: bool = True,
) -> list[SimDrive]:
    """Return the drives of `robot`, with its physics, its logs and the devices on its platform.

    The paths are those of the options of `cdpr sim up`; `stack` closes everything. Raises
    BadInputError.
    """
    body, plants = physics_of(robot, plant, detached)
    for name, path in (("--scanner", scanner), ("--camera", camera)):
        if body is None and path is not None:
            raise BadInputError(f"{name}: for a robot with its platform on the cables")
    winches = [axis.winch for axis in robot.axes]
    own_log = truth_log if robot.is_winch else None
    drives = drives_of(stack, winches, plants, body, store, own_log)
    shared = board_of(stack, board, camera, drives, lockstep=lockstep)
    if body is not None:
        truth = RobotPlant.load_file(plant)
        _record(drives, body, truth, truth_log, scanner, shared)
        if camera is not None and shared is not None:
            described = plant if "camera" in truth.model_fields_set else None
            stack.callback(OwnCamera(camera, shared.path, described).stop)
    elif truth_log is not None and not robot.is_winch:
        with os_error_as(BadInputError, f"--truth-log {truth_log}"):
            drives[0].record_with(MotorsLog(truth_log, [one.axis.motor for one in drives]))
    return drives


def board_of(
    stack: ExitStack,
    path: Path | None,
    camera: Path | None,
    drives: Sequence[SimDrive],
    *,
    lockstep: bool,
) -> PhysicsBoard | None:
    """Return the board at `path` with the axes of `drives`; a camera always needs one."""
    if path is None and camera is not None:
        path = Path(stack.enter_context(TemporaryDirectory(prefix="cdpr-board-"))) / "board"
    if path is None:
        return None
    made = PhysicsBoard.create(path, len(drives), lockstep=lockstep)
    shared = stack.enter_context(made)
    for number, drive in enumerate(drives):
        drive.connect(shared.axis(number))
    return shared


def drives_of(
    stack: ExitStack,
    winches: Sequence[Winch],
    plants: Sequence[Plant],
    body: CableRobot | None,
    store: Path | None,
    truth_log: Path | None,
) -> list[SimDrive]:
    """Return a drive for each winch, with the physics of `body` if there is one."""
    members = [None] * len(plants) if body is None else body.members()
    drives = []
    for serial, (winch, plant, member) in enumerate(zip(winches, plants, members, strict=True), 1):
        kept = _store_file(store, serial)
        with (
            os_error_as(BadInputError, f"--truth-log {truth_log}"),
            raised_as(BadInputError, StoreError),
        ):
            drive = SimDrive.for_winch(
                *(winch, plant), truth_log=truth_log, store=kept, serial=serial, robot=member
            )
        stack.callback(drive.close)
        drives.append(drive)
    return drives


def frame_log_at(path: Path | None) -> FrameLog | None:
    """Return the frame log at `path`; the buses close it when they end."""
    if path is None:
        return None
    with os_error_as(BadInputError, f"--frame-log {path}"):
        return FrameLog(path)


def _store_file(folder: Path | None, serial: int) -> Path | None:
    """Return the file for the stored parameters of the drive with this serial number."""
    if folder is None:
        return None
    with os_error_as(BadInputError, f"--store {folder}"):
        folder.mkdir(parents=True, exist_ok=True)
    return folder / f"drive-{serial}.json"


def _record(
    drives: Sequence[SimDrive],
    body: CableRobot,
    plant: RobotPlant,
    truth_log: Path | None,
    scanner: Path | None,
    board: PhysicsBoard | None,
) -> None:
    """Set up the logs of the platform's pose, each at another drive of the three or more."""
    if truth_log is not None:
        with os_error_as(BadInputError, f"--truth-log {truth_log}"):
            drives[0].record_with(PoseLog(truth_log, body))
    if board is not None:
        drives[1].record_with(BoardPose(body, board.platform))
    if scanner is not None:
        with os_error_as(BadInputError, f"--scanner {scanner}"):
            drives[-1].record_with(PoseScanner(scanner, body, plant.scanner, plant.seed))


def physics_of(
    robot: Robot, plant: Path | None, detached: bool
) -> tuple[CableRobot | None, Sequence[Plant]]:
    """Return the body that all axes move, or None, and the plant of each motor.

    Raises BadInputError if the plant file cannot be used or does not fit the robot.
    """
    n, platform = len(robot.axes), robot.platform
    with raised_as(BadInputError, ProfileError):
        if platform is None:
            one = Plant.load_file(plant)
            return None, [one.model_copy(update={"seed": (one.seed + i) % 2**32}) for i in range(n)]
        whole = RobotPlant.load_file(plant)
    try:
        whole.require_fit(n, len(platform.home_m))
        motors = whole.motor_plants(n, [axis.winch for axis in robot.axes])
        if detached:
            return None, motors
        return CableRobot(_shape(robot, platform), whole, _transmissions(robot)), motors
    except ValueError as error:
        raise BadInputError(f"--plant {plant}: {error}") from error


@dataclass(frozen=True)
class TrueGeometry:
    """The true geometry of a simulated robot, to evaluate a calibration."""

    exit_points_m: NDArray[np.float64]
    """(n, 3)"""
    drum_errors: NDArray[np.float64]
    """Relative error of the cable paid out by one turn of each motor, (n,)."""
    elongation_error: float
    """Relative error of the cables' elongation without creep."""


def true_geometry(robot: Robot, plant: Path | None) -> TrueGeometry:
    """Return the truth of a robot's simulator; raises BadInputError."""
    assert robot.platform is not None  # callers calibrate its cables
    body, plants = physics_of(robot, plant, detached=False)
    assert body is not None  # there is a platform on the cables
    drives = [
        SimDrive.for_winch(axis.winch, plant, robot=member)
        for axis, plant, member in zip(robot.axes, plants, body.members(), strict=True)
    ]
    for drive in drives:
        drive.close()
    nominal = np.array([one.cable_m_per_rad for one in _transmissions(robot)])
    return TrueGeometry(
        body.platform["exit"][0][: body.n].copy(),
        np.abs(body.motors["cable_gain"]) / np.abs(nominal) - 1.0,
        1.0 / (1.0 + RobotPlant.load_file(plant).cables.stiffness_error) - 1.0,
    )


def _shape(robot: Robot, platform: Platform) -> RobotShape:
    body = platform.body
    return RobotShape(
        exit_points_m=platform.exit_points_m,
        anchor_points_m=platform.anchor_points_m,
        mass_kg=platform.mass_kg,
        home_m=platform.home_m,
        weights_N_m=[axis.winch.cable.weight_per_length_N_m for axis in robot.axes],
        home_rotation_rad=platform.home_rotation_rad,
        inertia_kg_m2=platform.inertia_kg_m2,
        centre_of_mass_m=platform.centre_of_mass_m,
        pulley_radii_m=platform.pulley_radius_m,
        pulley_axes=platform.pulley_axes,
        feet_m=(
            None
            if body is None
            else list(itertools.product(*zip(body.min_m, body.max_m, strict=True)))
        ),
    )


def _transmissions(robot: Robot) -> list[Transmission]:
    return [transmission_of(axis.winch) for axis in robot.axes]
