"""Ideal platforms with 3 and with 6 directions, exactly at their set-points, and a hand stream."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from cdpr_profiles.platform import Platform
from cdpr_rt.arrays import BoolArray, FloatArray
from cdpr_rt.core.estimate import Estimator
from cdpr_rt.core.exchange import AxisFeedback, Setpoint
from cdpr_rt.core.shared_block import SAMPLE, SharedBlock
from cdpr_rt.model.platform_model import PlatformModel, platform_model
from cdpr_rt.model.workspace import SHARES
from cdpr_rt.motion.pose_stream import PoseStream
from cdpr_rt.programs.platform_program import PlatformParts, PlatformProgram
from cdpr_rt.programs.pose import PoseProgram

PERIOD_S = 1e-3
PLANE = Platform(
    mass_kg=5.0,
    home_m=(0.0, 1.2),
    home_tolerance_m=0.05,
    workspace_min_m=(-0.5, 1.3),
    workspace_max_m=(0.5, 1.8),
    speed_m_s=0.5,
    acceleration_m_s2=2.0,
    exit_points_m=((-2.0, 3.0), (2.0, 3.0), (-2.0, 0.0), (2.0, 0.0)),
    anchor_points_m=((-0.2, -0.15), (0.2, -0.15), (-0.2, 0.15), (0.2, 0.15)),
    home_rotation_rad=(0.1,),
    workspace_angle_rad=0.25,
    angular_speed_rad_s=0.8,
    angular_acceleration_rad_s2=5.0,
)
# CoGiRo, as published by Mahnke and Caverly (2025), table 1
ROOM = Platform(
    mass_kg=100.0,
    home_m=(0.0, 0.0, 0.6),
    home_tolerance_m=0.05,
    workspace_min_m=(-1.0, -1.0, 0.7),
    workspace_max_m=(1.0, 1.0, 1.7),
    speed_m_s=0.5,
    acceleration_m_s2=1.0,
    exit_points_m=(
        (-7.20, -5.44, 5.39), (-7.48, -5.15, 5.40), (-7.41, 5.19, 5.40), (-7.12, 5.47, 5.41),
        (7.22, 5.37, 5.41), (7.51, 5.08, 5.42), (7.43, -5.26, 5.39), (7.14, -5.54, 5.40),
    ),
    anchor_points_m=(
        (0.503, -0.493, 0.0), (-0.510, 0.351, 0.998), (-0.503, -0.270, 0.0), (0.496, 0.356, 1.0),
        (-0.503, 0.493, 0.0), (0.500, -0.340, 0.999), (0.502, 0.275, -0.001),
        (-0.505, -0.346, 0.998),
    ),
    home_rotation_rad=(0.0, 0.0, 0.05),
    workspace_angle_rad=0.3,
    angular_speed_rad_s=0.4,
    angular_acceleration_rad_s2=1.0,
)  # fmt: skip


class NothingFound:
    """A fit that finds nothing about any motor."""

    taken_up_N = np.zeros(1)

    def prepare(self, tension_N: FloatArray) -> None:
        self._angle_rad = np.full(tension_N.size, np.nan)

    def begin(self, position_rad: FloatArray) -> None: ...
    def take(self, position_rad: FloatArray, tension_N: FloatArray) -> None: ...

    def begin_learning(self) -> None: ...

    def end(self) -> FloatArray:
        return self._angle_rad


class IdealControl:
    """A platform exactly at its set-point; its workspace says which tensions exist."""

    def __init__(self, model: PlatformModel) -> None:
        n, d = model.kinematics.n, model.size
        self.model, self.workspace = model, model.workspace()
        self.position = model.home.copy()
        self.velocity, self.acceleration = np.zeros((2, d))
        self.off = np.zeros(d)
        """How far the platform is from its set-point."""
        self.tension_N, self.least_N, self.low_N = np.array([model.low_N] * 3)
        self.torque_Nm = np.full(n, 10.0)
        self.effort_Nm, self.compensation_Nm = np.zeros((2, n))
        self.motor_loss_Nm, self.cogging_Nm = np.zeros((2, n))
        self.inertia_kg_m2, self.residual_m, self.suspect = np.full(n, 1e-4), 0.0, -1
        self.jump_m, self.jumped = 0.0, -1
        self.free_lengths_m = np.zeros(n)
        self.swing_rad = self.swing_m = 0.0
        self._there = model.pose(model.home)
        self.ways: list[tuple[FloatArray, FloatArray]] = []
        """The checked ways: start and end of each."""

    @property
    def shaped(self) -> FloatArray:
        return self.position

    @property
    def estimated(self) -> FloatArray:
        return np.asarray(self.position + self.off)

    @property
    def pose(self) -> FloatArray:
        return seven(self.model, self.estimated)

    learnt_Nm = None
    pull_fit = NothingFound()

    def notices(self) -> list[str]:
        return []

    def suspects(self, jump: bool = False) -> list[int]:
        return []

    def clear_notices(self) -> None: ...

    def measure_tensions(self, *readings: FloatArray | BoolArray) -> None: ...
    def forget_motors(self) -> None: ...
    def stand_in(self) -> None: ...
    def clear_compensation(self) -> None: ...
    def begin(self, feedback: AxisFeedback) -> None: ...
    def take_lengths(self, length_m: FloatArray, feedback: AxisFeedback) -> None: ...
    def reset(self) -> None: ...

    def update(self, feedback: AxisFeedback, setpoint: Setpoint, torque_Nm: FloatArray) -> None: ...

    def stand_still(self, *, on_stand: bool = False) -> None:
        self.position[:] = self.estimated
        self.velocity[:] = self.acceleration[:] = self.off[:] = 0.0

    def lengths_at_home(self, tension_N: FloatArray) -> FloatArray:
        return self.model.kinematics.lengths(self.model.pose(self.model.home))

    def tension_infeasibility(self) -> str:
        return ""

    def _at(self, position: FloatArray) -> Any:
        self._there.array[:] = self.model.poses(position[None])[0]
        return self._there

    def is_feasible(self, position: FloatArray) -> bool:
        return self.workspace.is_feasible(self._at(position))

    def contact_ahead(self, position: FloatArray) -> int:
        return self.model.interference.contact_ahead(self.position, position)

    def contact_at(self, position: FloatArray) -> int:
        return self.model.interference.contact_at(self.position, position)

    def contact(self, pair: int) -> str:
        return self.model.interference.within_clearance(pair)

    def infeasibility(self, position: FloatArray) -> str:
        return self.workspace.infeasibility(self._at(position))

    def way_infeasibility(self, position: FloatArray, start: FloatArray | None = None) -> str:
        share, begin = SHARES[:, None], self.position if start is None else start
        self.ways.append((np.array(begin), np.array(position)))
        poses = self.model.poses((1.0 - share) * begin + share * position)
        found = self.workspace.first_infeasible(poses)
        return "" if found is None else found[1]


class SteppedPlatform(ABC):
    """A platform under a program, cycle by cycle."""

    program: PlatformProgram

    @abstractmethod
    def cycle(self) -> None:
        """Run one cycle."""

    def run(self, seconds: float) -> None:
        for _ in range(round(seconds / PERIOD_S)):
            self.cycle()

    def until_rest(self) -> None:
        for _ in range(20_000):
            self.cycle()
            if self.program.at_rest:
                return
        raise AssertionError("does not come to rest")


class IdealPlatform(SteppedPlatform):
    """One of these platforms under a program, with the history of its set-point."""

    def __init__(self, platform: Platform, low_N: float, high_N: float) -> None:
        n = len(platform.exit_points_m)
        self.model = platform_model(platform, np.full(n, low_N), np.full(n, high_N))
        self.control = IdealControl(self.model)
        self.parts = PlatformParts(self.model, self.control, Estimator(n, PERIOD_S), PERIOD_S)
        self.block = SharedBlock.create(n, 1.0, 1000.0)
        self.pose = PoseProgram(self.parts, np.full(n, 10.0), PoseStream(self.block, PERIOD_S))
        self.program = self.pose
        self.feedback, self.setpoint, self.torque = AxisFeedback(n), Setpoint(n), np.zeros(n)
        self.feedback.valid[:] = True
        self.sample = np.zeros((), SAMPLE)
        self.sample["session"] = 1
        self.restart()

    def restart(self, position: FloatArray | None = None) -> None:
        """Start again, in the middle of the box or elsewhere."""
        platform, k = self.model.platform, self.model.positions
        middle = 0.5 * np.add(platform.workspace_min_m, platform.workspace_max_m)
        self.parts.estimator.set_lengths(np.zeros(self.torque.size), np.ones(self.torque.size))
        self.parts.estimator.estimate.length_known[:] = True
        self.parts.cycle, self.parts.tight = -2, True
        self.control.off[:] = 0.0
        self.program = self.pose
        self.pose.start(self.feedback, self.setpoint, self.torque)
        self.control.position[:] = 0.0
        self.control.position[:k] = middle
        if position is not None:
            self.control.position[:] = position
        self.pose.command({})
        self.path, self.paces = [self.control.position.copy()], [np.zeros(self.model.size)]

    def switch(self, program: PlatformProgram, wanted: Mapping[str, Any]) -> None:
        self.prepare(program, wanted)
        program.start(self.feedback, self.setpoint, self.torque)
        program.command(wanted)
        self.program = program

    @staticmethod
    def prepare(program: PlatformProgram, wanted: Mapping[str, Any]) -> None:
        if (work := program.preparation(wanted)) is not None:
            work()

    def cycle(self) -> None:
        self.feedback.cycle += 1
        self.program.update(self.feedback, self.setpoint, self.torque)
        self.path.append(self.control.position.copy())
        self.paces.append(self.control.velocity.copy())

    def hand(
        self,
        position_m: Any,
        rotation: Rotation | None = None,
        *,
        scale: float = 1.0,
        buttons: int = 0,
        cycles: int = 20,
    ) -> None:
        """Post the hand's pose, then run some cycles."""
        x, y, z, w = (Rotation.identity() if rotation is None else rotation).as_quat()
        sample = self.sample
        sample["sequence"] += 1
        sample["sent_ns"] = 1_000_000 * int(self.feedback.cycle)
        sample["position_m"], sample["quaternion"] = position_m, (w, x, y, z)
        sample["scale"], sample["buttons"] = scale, buttons
        self.block.post_sample(sample[()])
        for _ in range(cycles):
            self.cycle()

    def check_motion(self) -> None:
        """Velocity and acceleration keep their bounds along each direction."""
        paces = np.array(self.paces)
        assert (np.abs(paces) <= self.model.speed * (1 + 1e-9)).all()
        most = self.model.acceleration * PERIOD_S
        assert (np.abs(np.diff(paces, axis=0)) <= most * (1 + 1e-9) + 1e-12).all()


def rotation_of(model: PlatformModel, position: FloatArray) -> Rotation:
    """Return the rotation from home's orientation at a position (d,), about the room's axes."""
    phi = np.zeros(3)
    phi[[i - 3 for i in model.kinematics.directions if i > 2]] = position[model.positions :]
    return Rotation.from_rotvec(phi)


def home_rotation(model: PlatformModel) -> Rotation:
    """Return the orientation at home."""
    rotation_rad = model.platform.home_rotation_rad
    return Rotation.from_rotvec(np.pad(rotation_rad, (3 - len(rotation_rad), 0)))


def seven(model: PlatformModel, position: FloatArray) -> NDArray[np.float64]:
    """Return the pose (7,) at a position (d,), by SciPy."""
    x, y, z, w = (rotation_of(model, position) * home_rotation(model)).as_quat(canonical=True)
    at = np.pad(position[: model.positions], (0, 3 - model.positions))
    return np.array([*at, w, x, y, z])
