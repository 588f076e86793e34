"""Compile all kernels of the product, in several parallel processes."""

from __future__ import annotations

import math
import multiprocessing
import os
import sys
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor, as_completed
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Final

import numpy as np

from cdpr_profiles import load_robot
from cdpr_profiles.jit import machine_code_lost
from cdpr_rt.core.shared_block import SharedBlock
from cdpr_rt.diagnosis.predictions import CableLoss, free_rotation
from cdpr_rt.diagnosis.subject import Subject
from cdpr_rt.identification import windows
from cdpr_rt.loop.warm_up import warm_up
from cdpr_rt.model.hanging import HangingSearch
from cdpr_rt.model.own_distribution import OwnDistribution
from cdpr_rt.model.platform_model import platform_model_of
from cdpr_rt.model.reachable import Reach
from cdpr_rt.model.robot_arrays import limits_of
from cdpr_rt.model.statics import statics_of
from cdpr_rt.motion.path_description import Move, PathDescription
from cdpr_rt.motion.pose_stream import PoseStream
from cdpr_rt.programs.path_planning import PathPlanner
from cdpr_rt.programs.path_store import first_fault
from cdpr_tools.compiling import announce_compiling
from cdpr_tools.composition.loop_parts import loop_parts
from cdpr_tools.composition.robot_physics import true_geometry

_RING_S: Final = 1.0
_PERIOD_S: Final = 1e-3
_OPTIONAL: Final = frozenset(
    (
        *("cv2", "fastapi", "foxglove", "h11", "httpx", "mcap", "prometheus_client", "pyarrow"),
        *("starlette", "uvicorn", "websockets", "zstandard"),
    )
)
"""Modules of the extras `camera` and `daemon`."""


def compile_kernels(processes: int) -> bool:
    """Compile every kernel that commands use and that has no cached machine code.

    `processes` run in parallel and report their progress on standard error. Stop and return False
    if the machine code of a kernel cannot be kept.
    """
    parts, done = sum(map(len, _STAGES)), 0
    # new processes inherit no lock or thread of this one
    with ProcessPoolExecutor(processes, multiprocessing.get_context("spawn")) as pool:
        for stage in _STAGES:
            tasks = {pool.submit(compile_with, what, task): what for what, task in stage.items()}
            for task in as_completed(tasks):
                if not task.result():
                    pool.shutdown(cancel_futures=True)
                    return False
                done += 1
                print(f"part {done} of {parts} is compiled: {tasks[task]}", file=sys.stderr)
    return True


def compile_with(what: str, task: Callable[[], None]) -> bool:
    """Run `task`, which compiles kernels; return whether their machine code is kept.

    `what` names the kernels. If an extra is not installed, skip its kernels: no command uses them.
    Profiles in the user's folder are ignored, because they may have the names of shipped ones.
    """
    os.environ["XDG_CONFIG_HOME"] = "/nonexistent"
    announce_compiling(what)
    try:
        task()
    except ModuleNotFoundError as error:
        if (error.name or "").partition(".")[0] not in _OPTIONAL:
            raise
    return not machine_code_lost()


def _loops(*names: str) -> None:
    """Make the control loops of robots and run their programs for some cycles."""
    for name in names:
        robot = load_robot(name)
        warm_up(len(robot.axes), robot.sync_period_s)
        block = SharedBlock.create(len(robot.axes), _RING_S, 1.0 / robot.sync_period_s)
        loop_parts(robot, limits_of(robot), block)
        os.close(block.fd)


def _platform_loops() -> None:
    """Make the loops of a planar and of a spatial platform, and check a user's tensions."""
    _loops("planar-3", "spatial-8")
    OwnDistribution(lambda *_: 0.0, np.zeros(2), np.ones(2), np.ones(2))


def _contacts() -> None:
    """Search for contacts of a moving platform, and receive a stream of set-points."""
    model = platform_model_of(load_robot("spatial-8"))
    model.interference.clearances(model.home_pose.array[None])
    block = SharedBlock.create(model.kinematics.n, _RING_S, 1.0 / _PERIOD_S)
    PoseStream(block, _PERIOD_S)  # binds kernels to its buffer
    os.close(block.fd)


def _simulators() -> None:
    """Advance simulated motors and platforms, and take an image."""
    true_geometry(load_robot("planar-3"), None)
    _identification()
    from cdpr_sim_bus.camera.sim_camera import SimCamera  # noqa: PLC0415  needs OpenCV
    from cdpr_sim_bus.physics_board import PlatformState  # noqa: PLC0415
    from cdpr_sim_bus.robot.camera_plant import CameraPlant  # noqa: PLC0415

    there = PlatformState(0.0, (0.0,) * 3, tuple(np.eye(3).flat), (0.0,) * 3, (0.0,) * 3)
    SimCamera(CameraPlant()).grab(there)


def _identification() -> None:
    """Cut a run into windows, and make the regressors of its torque."""
    time_s = np.linspace(0.0, 4.0, 4001)
    for speed in (0.1, 1.0):
        angle = np.linspace(0.0, 4.0 * speed, 4001)
        run = windows.SweepData(time_s, angle, np.zeros(4001), angle, np.full(4001, speed))
        cut = windows.cut(run, 0.0)
        assert cut is not None  # the run lasts long enough
        windows.matrix(cut, windows.ColumnLayout((1, 4), windows.STARTS[0]), 0, 2)


def _buses() -> None:
    """Boot robots on one and two simulated buses: frames, truth log, rows."""
    # they need the daemon's extra
    from cdpr_tools.client.handle_errors import robot_errors  # noqa: PLC0415
    from cdpr_tools.lockstep_robot import LockstepRobot  # noqa: PLC0415

    for name in ("bench-2", "bench-8", "planar-3"):
        with (
            robot_errors(),
            TemporaryDirectory() as folder,
            LockstepRobot(name, record=Path(folder), as_calibrated=False) as robot,
        ):
            robot.turn(10)


def _planning() -> None:
    """Plan a path, and search for reachable poses."""
    robot = load_robot("planar-3")
    planner = PathPlanner(robot)
    model, coordinates = planner.model, planner.coordinates
    start = np.array(coordinates.reference)
    path = PathDescription("path", coordinates, start, 1)
    path.add(Move(2, start + 0.05, math.inf, blend_m=0.01))
    path.add(Move(3, start, 0.1))
    timed = planner.plan(path).timed
    assert timed is not None  # a few centimetres beside home
    first_fault(model, timed.samples, timed.period_s)
    stored = timed.samples.copy()
    stored.flags.writeable = False  # as in a plan that the loop reads from its file
    first_fault(model, stored, timed.period_s)
    Reach(model).draw(1, 1)
    statics = statics_of(robot)
    model.interference.clearances(statics.poses(statics.points()[:1]))


def _losses() -> None:
    """Simulate the loss of a cable, the swing of a platform that turns freely, and how it hangs."""
    model = platform_model_of(load_robot("spatial-8"))
    HangingSearch(model).find(model.kinematics.lengths(model.home_pose), model.home_pose)
    free_rotation(platform_model_of(load_robot("planar-3")))
    subject = Subject(load_robot("suspended-8"))
    CableLoss(subject).swing(0, subject.platform.home_m)


_STAGES: Final[tuple[dict[str, Callable[[], None]], ...]] = (
    {
        "the control loop": _platform_loops,
        "the simulation": _simulators,
        "contacts and streams": _contacts,
        "the loss of a cable": _losses,
        "paths and poses": _planning,
    },
    {"the buses": _buses},
)
"""Tasks by the kernels that they compile. Kernels of a stage call kernels of earlier stages. Tasks
that begin at the same time share few kernels, so that no kernel is compiled twice."""
