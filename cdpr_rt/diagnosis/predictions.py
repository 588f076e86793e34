"""Predict how a platform moves after a failure or a slip, and its natural frequencies.

Motions after a failure are simulated, because an equilibrium does not show them: overloaded motors
yield, and the remaining winches then lower the platform.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum, auto
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from cdpr_profiles import RobotAxis
from cdpr_rt.arrays import FloatArray
from cdpr_rt.control.winch_speed_loop import (
    DRUM_TENSION_SHARE,
    FILTER_S,
    PUSH_SHARE,
    BANDWIDTH_rad_s,
    FASTEST_IN_m_s,
    HANGING_LOAD_1_s,
    SPARE_m,
    UNKNOWN_POSE_m_s,
    control_speed,
)
from cdpr_rt.diagnosis.subject import Subject
from cdpr_rt.jit import jit
from cdpr_rt.model import free_rotation_kernel as rotation_kernel
from cdpr_rt.model.cable_kernel import (
    ARC,
    CABLE_ROWS,
    FREE,
    hang,
    run_cables,
    run_poses,
    tension_rise,
)
from cdpr_rt.model.platform_model import PlatformModel
from cdpr_rt.model.pose import Pose, exponential
from cdpr_rt.model.rigid_body import free_directions, in_space, inertia_kg_m2, is_point
from cdpr_rt.model.robot_arrays import LEAST_REDUNDANCY
from cdpr_rt.platform.body_kernel import body_of, write_mass_matrix, write_wrench
from cdpr_rt.platform.loop_kernel import factor, solve
from cdpr_rt.platform.loop_plant import LEAST, CABLE_DAMPING_s, cable_stiffness
from cdpr_rt.platform.motor_learning import COGGING_SHARE, MOST_SHARE

# Kernel of a platform on n cables that has lost one, or its drive: it swings and is lowered. A
# rigid body above level ground hangs on elastic cables. Each is wound by a rotor whose motor pulls
# as commanded and yields to more.

WINCHES = np.dtype(
    [
        ("stiffness_N_m", "<f8"),  # of its cable
        ("damping_N_s_m", "<f8"),
        ("rotor_kg", "<f8"),  # as the cable feels it
        ("held_N", "<f8"),  # pull until the lowering begins
        ("weight_N", "<f8"),  # pull when the lowering begins
        ("low_N", "<f8"),
        ("high_N", "<f8"),
        ("gain_N_s_m", "<f8"),  # of its speed loop
        ("friction_N", "<f8"),  # dry, of the winch, at the cable
        ("left_m", "<f8"),  # least length that is paid out
        ("push_N", "<f8"),  # largest outward push of its motor for that length
    ]
)
"""A record for each cable, (n,)."""
PARAMETERS = np.dtype(
    [
        ("period_s", "<f8"),
        ("steps", "<i8"),  # in a cycle
        ("held_cycles", "<i8"),  # until the lowering begins
        ("cut", "<i8"),  # cable that carries nothing, -1 for none
        ("dead", "<i8"),  # motor without torque, -1 for none
        ("misled_N", "<f8"),  # force away from the cut cable's exit point until then
        ("paying_out_m_s", "<f8"),
        ("fastest_in_m_s", "<f8"),
        ("integral_rate_1_s", "<f8"),
        ("up", "<i8"),  # coordinate against gravity
        ("ground_m", "<f8"),
        ("foot_N_m", "<f8"),
        ("foot_N_s_m", "<f8"),
        ("friction", "<f8"),
    ]
)
"""One record, (1,)."""
_SLIDING_m_s = 0.01
_STILL_m_s, _STILL_S = 0.02, 0.5
_QUIET_m_s, _QUIET_S = 2e-3, 1.0


@jit
def fall(
    parameters: Any,
    winches: Any,
    body: FloatArray,
    free: FloatArray,
    geometry: FloatArray,
    feet: FloatArray,
    start: FloatArray,
    path: FloatArray,
) -> int:
    """Write the poses (c, 4, 3) after each of c cycles into `path`; return the number of cycles.

    When nothing has moved for a second, the winches stop pulling, as at the end of `lower`. When
    nothing has moved for another second, friction holds the platform, and the simulation ends. The
    platform rests at `start` (4, 3). `body` is that of `body_kernel`, `geometry` (13, n) that of
    `cable_kernel`. `free` (6,) is 1 for existing components of the twist, 0 otherwise. `feet`
    (k, 3) are points that can touch the ground, m, in the platform's frame.
    """
    c, n = parameters[0], winches.size
    h, weight = c.period_s / c.steps, c.period_s / (c.period_s + FILTER_S)
    pose, twist, cables = start.copy(), np.zeros(6), np.empty((CABLE_ROWS, n))
    length, rate, tension, pull = np.empty(n), np.zeros(n), np.zeros(n), winches["held_N"].copy()
    last, speed, integral, torque = np.zeros(n), np.zeros(n), np.zeros(n), np.zeros(n)
    jumped = np.zeros(n, np.bool_)
    out, as_cable, scratch = np.full(n, c.paying_out_m_s), np.ones(n), np.zeros((4, 6, 6))
    left, low = winches["left_m"].copy(), winches["low_N"].copy()
    unseen, stuck = np.zeros(n), np.zeros(n, np.bool_)
    noise, deviation = np.zeros(n), np.zeros(n)
    run_cables(geometry, pose, cables)
    for i in range(n):
        middle_N = pull[i] - tension_rise(geometry, cables, i)
        length[i] = cables[FREE, i] + cables[ARC, i] - middle_N / winches[i].stiffness_N_m
    still = quiet = 0
    for cycle in range(path.shape[0]):
        if cycle == c.held_cycles:
            for i in range(n):
                last[i], speed[i] = length[i], rate[i]
                integral[i] = -max(winches[i].weight_N, winches[i].low_N)
        if cycle >= c.held_cycles:
            control_speed(
                c.period_s, weight, low, winches["high_N"], out, as_cable, winches["gain_N_s_m"],
                left, unseen, stuck, noise, deviation, winches["push_N"], length, last, jumped,
                speed, integral, pull, torque, c.fastest_in_m_s, c.integral_rate_1_s,
            )  # fmt: skip
        if c.dead >= 0:
            pull[c.dead] = 0.0
        standing = False
        for _ in range(c.steps):
            run_cables(geometry, pose, cables)
            _wind(h, winches, geometry, cables, twist, pull, length, rate, tension)
            if c.cut >= 0:
                tension[c.cut] = -c.misled_N if cycle < c.held_cycles else 0.0
            standing = _step(
                h, c, body, free, geometry, cables, tension, feet, pose, twist, scratch
            )
        path[cycle] = pose
        slow = math.sqrt(twist[0] ** 2 + twist[1] ** 2 + twist[2] ** 2) < _STILL_m_s
        still = still + 1 if standing and slow else 0
        if still * c.period_s > _STILL_S:
            return cycle + 1
        moves = cycle <= c.held_cycles or _fastest_m_s(twist, rate, c.cut) > _QUIET_m_s
        quiet = 0 if moves else quiet + 1
        if quiet * c.period_s > _QUIET_S:
            if not low.any():
                return cycle + 1
            low[:] = 0.0
            quiet = 0
    return len(path)


@jit
def _fastest_m_s(twist: FloatArray, rate: FloatArray, cut: int) -> float:
    """Return the highest speed of platform and winches, without that of a cut cable."""
    fastest = math.sqrt(twist[0] ** 2 + twist[1] ** 2 + twist[2] ** 2)
    for i in range(rate.size):
        if i != cut:
            fastest = max(fastest, abs(rate[i]))
    return fastest


@jit
def _wind(
    h: float,
    winches: Any,
    geometry: FloatArray,
    cables: FloatArray,
    twist: FloatArray,
    pull: FloatArray,
    length: FloatArray,
    rate: FloatArray,
    tension: FloatArray,
) -> None:
    """Write the tensions (n,) in the cables' middle, and advance their rotors by `h` s."""
    for i in range(winches.size):
        w = winches[i]
        stretch, growing = cables[FREE, i] + cables[ARC, i] - length[i], -rate[i]
        for k in range(6):
            growing += cables[k, i] * twist[k]
        carried = w.stiffness_N_m * stretch + w.damping_N_s_m * growing
        tension[i] = max(carried, 0.0) if stretch > 0.0 else 0.0
        at_winch = tension[i] + tension_rise(geometry, cables, i)
        unbraked = rate[i] + h * (at_winch - pull[i]) / w.rotor_kg
        braked = max(abs(unbraked) - h * w.friction_N / w.rotor_kg, 0.0)
        rate[i] = math.copysign(braked, unbraked)
        length[i] += h * rate[i]


@jit
def _step(
    h: float,
    c: Any,
    body: FloatArray,
    free: FloatArray,
    geometry: FloatArray,
    cables: FloatArray,
    tension: FloatArray,
    feet: FloatArray,
    pose: FloatArray,
    twist: FloatArray,
    scratch: FloatArray,
) -> bool:
    """Advance twist and pose by `h` s, semi-implicitly; return whether a foot touches the ground.

    `scratch` (4, 6, 6) is overwritten.
    """
    M, about = scratch[0], scratch[1, :4, :3]
    rest, wrench, turned, before = scratch[2, 0], scratch[2, 1], scratch[3, :3, :3], scratch[3, 3:]
    write_mass_matrix(body, pose, about, M)
    rest[:] = 0.0
    write_wrench(body, M, about, twist, rest, wrench)
    hang(geometry, pose, cables, wrench)
    for i in range(tension.size):
        for k in range(6):
            wrench[k] -= cables[k, i] * tension[i]
    standing = _stand(c, feet, pose, twist, wrench)
    for j in range(6):
        if free[j] == 0.0:
            wrench[j] = 0.0
            for k in range(6):
                M[j, k] = M[k, j] = 0.0
            M[j, j] = 1.0
    factor(M, 6)
    solve(M, wrench, 6)
    for k in range(6):
        twist[k] += h * wrench[k]
    for k in range(3):
        pose[0, k] += h * twist[k]
        rest[k] = h * twist[3 + k]
    exponential(rest[:3], turned)
    for i in range(3):
        for j in range(3):
            before[i, j] = pose[1 + i, j]
    for i in range(3):
        for j in range(3):
            pose[1 + i, j] = 0.0
            for k in range(3):
                pose[1 + i, j] += turned[i, k] * before[k, j]
    return standing


@jit
def _stand(
    c: Any, feet: FloatArray, pose: FloatArray, twist: FloatArray, wrench: FloatArray
) -> bool:
    """Add the wrench of the ground: under each foot a damped spring, and dry friction."""
    standing, up = False, c.up
    for j in range(feet.shape[0]):
        x, y, z = feet[j, 0], feet[j, 1], feet[j, 2]
        rx = pose[1, 0] * x + pose[1, 1] * y + pose[1, 2] * z
        ry = pose[2, 0] * x + pose[2, 1] * y + pose[2, 2] * z
        rz = pose[3, 0] * x + pose[3, 1] * y + pose[3, 2] * z
        arm, wx, wy, wz = (rx, ry, rz), twist[3], twist[4], twist[5]
        depth = c.ground_m - pose[0, up] - arm[up]
        if depth <= 0.0:
            continue
        standing = True
        velocity = (
            twist[0] + wy * rz - wz * ry,
            twist[1] + wz * rx - wx * rz,
            twist[2] + wx * ry - wy * rx,
        )
        load = max(c.foot_N_m * depth - c.foot_N_s_m * velocity[up], 0.0)
        square = velocity[0] ** 2 + velocity[1] ** 2 + velocity[2] ** 2 - velocity[up] ** 2
        drag = c.friction * load / (math.sqrt(max(square, 0.0)) + _SLIDING_m_s)
        fx = load if up == 0 else -drag * velocity[0]
        fy = load if up == 1 else -drag * velocity[1]
        fz = load if up == 2 else -drag * velocity[2]
        wrench[0] += fx
        wrench[1] += fy
        wrench[2] += fz
        wrench[3] += ry * fz - rz * fy
        wrench[4] += rz * fx - rx * fz
        wrench[5] += rx * fy - ry * fx
    return standing


SWING_S = 1.0
"""Time after the break in which the motion is evaluated as the swing; afterwards the platform is
lowered."""
_LONGEST_S = 30.0
_NOTICED_LATE, _NOTICING_S, _NOTICED_S = 1.5, 0.015, 0.25
"""Time until the break is detected: a factor on the time in which the rotor exceeds its speed
limit, the delay of filters and buses, and the longest time, which applies to cables with almost no
tension."""
_MISLED_SHARE = 0.25
"""Force of a control that follows a wrong pose, as a share of the span of tensions; the
proportional part saturates."""
FRICTIONS: Final = (0.0, 0.03, MOST_SHARE + COGGING_SHARE)
"""Friction of the winches as shares of the motors' rated torques, up to the share that a robot's
file includes; each share is simulated."""
_STANDS_m = 0.005
"""Height above the ground below which a platform counts as standing."""
_NEAREST_m = 1e-3
_STEP_rad = 0.2
"""Phase of the fastest oscillation, of rotors and platform or a foot on the ground, per step."""
_GROUND_FRICTION = 0.2
"""Friction coefficient of the ground, lower than that of most floors, so that the platform slides
further."""
_GROUND_DAMPING = 0.25
"""Damping of the ground as a share of critical damping, so low that the platform bounces."""


class Loss(Enum):
    """Loss after which a platform is lowered."""

    CABLE = auto()
    """A cable breaks."""
    DRIVE = auto()
    """A drive loses its torque; its cable stays on the winch, which the cable turns."""
    LENGTHS = auto()
    """The lengths become unknown; all winches still obey."""


@dataclass(frozen=True)
class Swing:
    """Motion of a platform that was at rest at a position when the loss occurred."""

    cable: int
    """The lost cable; 0 for lost lengths."""
    position_m: tuple[float, ...]
    swing_m: float
    """Largest distance of the platform's origin from its initial position within `SWING_S`."""
    turn_rad: float
    """Largest angle from the initial orientation within `SWING_S`."""
    away_m: float
    """Largest distance from that position until it lies still on the ground."""
    aside_m: float
    """Largest horizontal distance from that position until it lies still."""
    fastest_m_s: float
    """Highest speed downward."""
    hangs_m: float
    """Height above the ground at which friction of the winches may hold the platform without power;
    0 if it always comes down."""


def corner_swings(s: Subject, loss: Loss = Loss.CABLE) -> list[list[Swing]]:
    """Return for each cable the platform's motions at all corners of the box of targets.

    Lost lengths have one list. The platform has the orientation of home. A corner that is not a
    target is replaced by the nearest target on a grid. The lists are empty if there are no targets.
    """
    losses, cables = CableLoss(s), range(1 if loss is Loss.LENGTHS else s.n)
    return [[losses.swing(i, place, loss) for place in s.corner_targets] for i in cables]


class CableLoss:
    """Predicts the motion of a robot with a platform after a loss.

    - At rest, tensions are the least that keep the control's reserve from their lower bounds.
    - Until the loss is detected, each motor pulls as before. The pose that the control computes
      follows the cable that is wound in, and the control pulls the platform the other way, with a
      quarter of the span of tensions. With the broken cable's tension t, its rotor's mass m at
      the cable and the highest speed v of the limits, that lasts 1.5 m v/t + 15 ms, at most
      0.25 s. Other losses are detected after 15 ms.
    - Then the winches lower it as the program `lower` does without a known pose.
    - Cables are elastic, with the damping of their profiles, at most 2 ms of their stiffness. If
      their weight counts, half of it is on the platform, and winches hold the hanging cables;
      these do not sag. All `FRICTIONS` of winches are simulated, and the largest figures count:
      friction may hold the platform or turn it over.
    - The ground is level, as high as the stand at home, or as the platform's lowest point at the
      break if that is lower: a start inside the ground would fling the platform.
    """

    def __init__(self, s: Subject) -> None:
        """Take a robot."""
        self._model = model = s.model
        self._axes, self._period_s = s.axes, s.robot.sync_period_s
        self._rated_N, self._EA_N = s.rated_N, s.stiffness_N
        self._fastest_m_s = s.speed_rad_s * s.arm_m
        # steps are too long for more damping
        self._damping_s = np.minimum(s.damping_s, CABLE_DAMPING_s)
        self._winches = np.zeros(s.n, WINCHES)
        self._winches["rotor_kg"] = s.rotor_kg
        self._winches["gain_N_s_m"] = BANDWIDTH_rad_s * s.rotor_kg
        self._winches["low_N"] = DRUM_TENSION_SHARE * model.low_N
        self._winches["high_N"] = np.minimum(model.high_N, s.torque_Nm / s.arm_m)
        self._winches["push_N"] = PUSH_SHARE * FRICTIONS[-1] * self._rated_N
        self._home_m = model.kinematics.lengths(model.home_pose)
        self._resting = model.least_tensions(model.low_N + model.reserve_N, model.high_N)
        self._weight_only = model.least_tensions(np.zeros(s.n), model.high_N)
        self._body, self._free = body_of(model.platform), np.zeros(6)
        self._free[list(free_directions(model.platform))] = 1.0
        self._feet = np.unique(model.corners, axis=0)
        self._ground_m = self._lowest_m(model.home_pose.array)

    def swing(self, cable: int, position_m: tuple[float, ...], loss: Loss = Loss.CABLE) -> Swing:
        """Return the platform's motion at a position after the loss of a cable (from 0)."""
        start = self._model.pose(np.array(position_m))
        up, first = self._model.positions - 1, slice(math.ceil(SWING_S / self._period_s))
        largest = np.zeros(6)
        for friction in FRICTIONS:
            path = self.path(cable, start, friction, loss)
            moved = path[:, 0] - start.p
            away = np.linalg.norm(moved, axis=1)
            aside = np.linalg.norm(np.delete(moved, up, axis=1), axis=1)
            cosine = (np.einsum("kij,ij->k", path[first, 1:], start.Q) - 1.0) / 2.0
            turn = math.acos(min(max(float(cosine.min()), -1.0), 1.0))
            down_m_s = -np.diff(path[:, 0, up], prepend=start.p[up]).min() / self._period_s
            above_m = self._lowest_m(path[-1]) - self._level_m(start)
            found = (
                away[first].max(), turn, away.max(), aside.max(), down_m_s,
                above_m if above_m > _STANDS_m else 0.0,
            )  # fmt: skip
            largest = np.maximum(largest, found)
        return Swing(cable, tuple(position_m), *largest.tolist())

    def path(
        self, cable: int, start: Pose, friction: float = 0.0, loss: Loss = Loss.CABLE
    ) -> FloatArray:
        """Return the poses (c, 4, 3) of all cycles from a loss until the platform lies still.

        The simulation ends after 30 s. The platform is at rest at `start`; the winches' friction is
        `friction` times the motors' rated torque.
        """
        model, winches = self._model, self._winches
        W, tension_N = np.zeros((model.size, len(winches))), np.zeros(len(winches))
        model.kinematics.wrench_matrix(start, W)
        hanging, rise_N = model.kinematics.hanging(start)
        self._resting.solve(W, model.weight() + hanging, tension_N)
        winches["held_N"] = tension_N + rise_N
        self._weight_only.solve(W, model.weight() + hanging, tension_N)
        winches["weight_N"] = tension_N + rise_N
        cables = np.empty((CABLE_ROWS, len(winches)))
        run_cables(model.kinematics.geometry, start.array, cables)
        winches["stiffness_N_m"] = self._EA_N / np.maximum(cables[FREE] + cables[ARC], _NEAREST_m)
        winches["damping_N_s_m"] = self._damping_s * winches["stiffness_N_m"]
        winches["friction_N"] = friction * self._rated_N
        longest_m = np.maximum(self._home_m, model.kinematics.lengths(start))
        stretch_m = longest_m * model.high_N / self._EA_N
        spare_m = SPARE_m + model.platform.home_tolerance_m
        winches["left_m"] = self._home_m - model.kinematics.lengths(start) + stretch_m + spare_m
        path = np.empty((math.ceil(_LONGEST_S / self._period_s), 4, 3))
        cycles = fall(
            self._parameters(cable, start, loss), winches, self._body, self._free,
            model.kinematics.geometry, self._feet, start.array, path,
        )  # fmt: skip
        return path[:cycles]

    def _parameters(self, cable: int, start: Pose, loss: Loss) -> NDArray[np.void]:
        model, platform, period_s = self._model, self._model.platform, self._period_s
        quickest_rad_s = highest_rad_s(model, self._axes, start.p[: model.positions])
        steps = math.ceil(period_s * quickest_rad_s / _STEP_rad)
        per_kg = 1.0 / platform.mass_kg
        if not is_point(platform):
            arms_m = np.linalg.norm(self._feet - in_space(platform.centre_of_mass_m), axis=1)
            per_kg += float(arms_m.max() ** 2 / np.linalg.eigvalsh(inertia_kg_m2(platform))[0])
        foot_N_m = (_STEP_rad * steps / period_s) ** 2 / (per_kg * len(self._feet))
        p = np.zeros(1, PARAMETERS)
        p["period_s"], p["steps"] = period_s, steps
        p["cut"] = cable if loss is Loss.CABLE else -1
        p["dead"] = cable if loss is Loss.DRIVE else -1
        noticed_s = self._noticed_s(cable) if loss is Loss.CABLE else _NOTICING_S
        p["held_cycles"] = math.ceil(noticed_s / period_s)
        p["misled_N"] = _MISLED_SHARE * (model.high_N - model.low_N)[cable]
        p["paying_out_m_s"], p["fastest_in_m_s"] = UNKNOWN_POSE_m_s, FASTEST_IN_m_s
        p["integral_rate_1_s"] = HANGING_LOAD_1_s
        p["up"], p["ground_m"] = model.positions - 1, self._level_m(start)
        p["foot_N_m"], p["friction"] = foot_N_m, _GROUND_FRICTION
        p["foot_N_s_m"] = 2.0 * _GROUND_DAMPING * math.sqrt(foot_N_m / per_kg)
        return p

    def _level_m(self, start: Pose) -> float:
        """Return the height of the ground."""
        return min(self._ground_m, self._lowest_m(start.array))

    def _lowest_m(self, pose: FloatArray) -> float:
        standing = pose[0] + self._feet @ pose[1:].T
        return float(standing[:, self._model.positions - 1].min())

    def _noticed_s(self, cable: int) -> float:
        """Return the time until the loss of a cable is detected."""
        winch = self._winches[cable]
        momentum = winch["rotor_kg"] * self._fastest_m_s[cable]
        slack = winch["held_N"] * (_NOTICED_S - _NOTICING_S) < _NOTICED_LATE * momentum
        return _NOTICED_S if slack else _NOTICED_LATE * momentum / winch["held_N"] + _NOTICING_S


# The frequencies at which rotors and platform oscillate against each other over their cables.


def lowest_resonance_Hz(
    model: PlatformModel, axes: Sequence[RobotAxis], position_m: FloatArray
) -> FloatArray:
    """Return the lowest frequencies (...) at positions (..., dimensions), m, in home's orientation.

    Cable i has the stiffness k = EA / rho of its length, including the part on its pulley. If its
    weight counts, sag reduces k, at the least planned tensions. At its end is a rotor
    with the mass m = J / r^2 (J: its inertia, r: cable per radian). With D = diag(k),
    Jacobian A (n, d) and the platform's inertia M (d, d) about its centre of mass, the squares of
    all angular frequencies above zero are the eigenvalues of

        D^1/2 (A M^-1 A^T + diag(1 / m)) D^1/2

    Other effects of tensions, gear and drum are neglected. Frequencies are in Hz.
    """
    poses, k = model.poses(np.reshape(position_m, (-1, model.positions))), None
    if any(model.platform.cable_weights_N_m):
        at, EA = (Pose(array[0], array[1:]) for array in poses), _rigidities_N(axes)
        k = np.array([cable_stiffness(model, pose, EA)[LEAST] for pose in at])
    squares = _squares(model, axes, poses, k)[..., 0]
    return np.asarray(np.sqrt(squares) / (2.0 * np.pi)).reshape(np.shape(position_m)[:-1])


def highest_rad_s(model: PlatformModel, axes: Sequence[RobotAxis], position_m: FloatArray) -> float:
    """Return the highest angular frequency at one position (dimensions,), without sag, rad/s."""
    poses = model.poses(np.reshape(position_m, (-1, model.positions)))
    return float(np.sqrt(_squares(model, axes, poses)[0, -1]))


def _rigidities_N(axes: Sequence[RobotAxis]) -> FloatArray:
    return np.array([axis.winch.cable.stiffness_N for axis in axes])


def _squares(
    model: PlatformModel,
    axes: Sequence[RobotAxis],
    poses: FloatArray,
    stiffness_N_m: FloatArray | None = None,
) -> FloatArray:
    """Return the eigenvalues, ascending, of poses (m, 4, 3), (m, n); k is EA / rho by default."""
    platform, geometry = model.platform, model.about_centre_of_mass.geometry
    Q, chosen = model.home_pose.Q, list(free_directions(platform))
    poses = poses.copy()
    poses[:, 0] += Q @ in_space(platform.centre_of_mass_m)
    cables = np.empty((len(poses), CABLE_ROWS, geometry.shape[1]))
    run_poses(geometry, poses, cables)
    rho = np.maximum(cables[:, FREE] + cables[:, ARC], _NEAREST_m)
    A = np.swapaxes(cables[:, chosen], -1, -2)
    M = np.zeros((6, 6))
    M[:3, :3] = platform.mass_kg * np.eye(3)
    M[3:, 3:] = Q @ inertia_kg_m2(platform) @ Q.T
    mobility = np.linalg.inv(M[np.ix_(chosen, chosen)])
    winches = [axis.winch for axis in axes]
    rotors_per_kg = np.array(
        [w.cable_m_per_motor_rad**2 / w.motor.rotor_inertia_kg_m2 for w in winches]
    )
    root = np.sqrt(_rigidities_N(axes) / rho if stiffness_N_m is None else stiffness_N_m)
    inner = A @ mobility @ np.swapaxes(A, -1, -2) + np.diag(rotors_per_kg)
    return np.asarray(np.linalg.eigvalsh(root[..., :, None] * inner * root[..., None, :]))


# Effects of a slipping cable: whether the slip is detected, and how hard the cable snatches.

_SLIPS_m = (0.002, 0.005, 0.01, 0.02, 0.04, 0.08)
_SUDDEN_SHARE = 0.7
"""Share of a slip's jump that remains when it is detected, because low-passed residuals follow
it."""
_WITHIN_S, _STEP_s = 0.15, 5e-5
"""Time until the cable is taut again even after the longest slip, and time step."""


@dataclass(frozen=True)
class Slip:
    """Effects of a slip of one cable on a platform at rest, at the worst place."""

    unnoticed_m: float
    """Largest slow slip after which the lengths' disagreement is still within its limit."""
    sudden_m: float
    """Largest sudden slip that is not detected; at most `unnoticed_m`."""
    off_m: float
    """Error of the platform's position by an undetected slip; both may be infinite."""
    off_per_m: float
    """The same error per metre of slip."""
    peak_N: float
    """Highest tension when the cable becomes taut again, after any slip."""


def slips(s: Subject, places: Sequence[Sequence[float]] | None = None) -> list[Slip]:
    """Return for each cable the effects of its slip, at the worst of these places.

    By default, they are home and the corners of the targets.

    A slip s of cable i moves the pose by J^+ e_i s and has the normalised residual s sqrt(p_ii),
    with P = I - J J^+. A sudden slip is detected by the jump of the residual. Detection by tension
    is ignored, because cables may slip slowly.

    The highest tension is that of `_snatch_N`.
    """
    model, limits, n, positions = s.model, s.limits, s.n, s.model.positions
    resting = model.least_tensions(model.low_N + model.reserve_N, model.high_N)
    W, tension_N = np.zeros((model.size, n)), np.zeros(n)
    worst = np.zeros((5, n))
    if places is None:
        places = (tuple(model.home[:positions].tolist()), *s.corner_targets)
    for place in places:
        pose = model.pose(np.array(place))
        J = model.kinematics.jacobian(pose)
        inverse = np.linalg.pinv(J)
        redundancy = 1.0 - np.einsum("ij,ji->i", J, inverse)
        shown = np.sqrt(np.where(redundancy > LEAST_REDUNDANCY, redundancy, 0.0))
        with np.errstate(divide="ignore"):
            unnoticed_m = limits.lengths_disagree_m / shown
            jump_m = limits.lengths_jump_m / (_SUDDEN_SHARE * shown)
        off_per_m = np.linalg.norm(inverse[:positions], axis=0)
        model.kinematics.wrench_matrix(pose, W)
        hanging, rise_N = model.kinematics.hanging(pose)
        resting.solve(W, model.weight() + hanging, tension_N)
        held_N = tension_N + rise_N
        stiffness_N_m = s.stiffness_N / model.kinematics.lengths(pose)
        damping_N_s_m = s.damping_s * stiffness_N_m
        peak_N = _snatch_N(held_N, s.rotor_kg, stiffness_N_m, damping_N_s_m)
        sudden_m = np.minimum(unnoticed_m, jump_m)
        here = np.array([unnoticed_m, sudden_m, unnoticed_m * off_per_m, off_per_m, peak_N])
        worst = np.maximum(worst, here)
    return [Slip(*map(float, column)) for column in worst.T]


def _snatch_N(
    held_N: FloatArray,
    rotor_kg: FloatArray,
    stiffness_N_m: FloatArray,
    damping_N_s_m: FloatArray,
) -> FloatArray:
    """Return the highest tensions (n,) of cables that slip at rest, the worst of several slips.

    Each rotor winds in under the torque that held its cable, until the cable is taut. The platform
    is assumed to be fixed and the winches without friction.
    """
    slip_m = np.array(_SLIPS_m)[:, None]
    x, v = np.zeros((2, len(_SLIPS_m), held_N.size))
    peak_N = held_N.copy()
    for _ in range(math.ceil(_WITHIN_S / _STEP_s)):
        stretch_N = held_N + stiffness_N_m * (x - slip_m)
        taut = stretch_N > 0.0
        tension_N = np.where(taut, np.maximum(stretch_N + damping_N_s_m * v, 0.0), 0.0)
        v = v + _STEP_s * (held_N - tension_N) / rotor_kg
        x = x + _STEP_s * v
        peak_N = np.maximum(peak_N, tension_N.max(axis=0))
    return peak_N


# Oscillation of a platform in a plane about the rotation that no cable controls.
#
# See `free_rotation_kernel`: let ψ(p, t) be the angle at which tensions t at a position p have no
# moment. If the cables control the platform's position, its deviation δ from that angle follows
#
#     I_s δ'' = -κ δ - I ψ''
#
# almost without damping. ψ changes with position, tensions, and so with acceleration. A move
# leaves a swing of the amplitude sqrt(δ² + δ'²/ω²), ω² = κ/I_s. Friction of the winches, and the
# loop's forces against it, also excite swings.

_SWING_STEP_S = 2e-3
_SOLVED_EVERY = 10
"""Steps from one solution for ψ and κ to the next."""


@dataclass(frozen=True)
class FreeRotation:
    """The swing about a rotation that no cable controls, over the box of targets."""

    slowest_Hz: float
    fastest_Hz: float
    swing_rad: float
    """Largest amplitude that a move from corner to corner at full speed leaves."""
    swing_m: float
    """Amplitude of an anchor point."""

    def lasts_s(self, amplitude_m: float) -> float:
        """Return how long a swing of `swing_m` takes to fade to `amplitude_m`, s."""
        if self.swing_m <= amplitude_m:
            return 0.0
        rate_1_s = rotation_kernel.DAMPING_RATIO * math.tau * self.slowest_Hz
        return math.log(self.swing_m / amplitude_m) / rate_1_s


def free_rotation(model: PlatformModel) -> FreeRotation | None:
    """Return the swing of a platform whose set-points are averaged over SHAPING_s.

    Returns None if the cables control the platform's angle, if it has no angle, or if the cables
    turn it over.
    """
    platform = model.platform
    if not model.kinematics.turns_freely:
        return None
    box = zip(platform.workspace_min_m, platform.workspace_max_m, strict=True)
    ways = np.array(list(itertools.permutations(itertools.product(*box), 2)))
    position_m, acceleration_m_s2 = _along(ways, platform.speed_m_s, platform.acceleration_m_s2)
    solved = position_m[::_SOLVED_EVERY], acceleration_m_s2[::_SOLVED_EVERY]
    psi, kappa, inertia, reach = np.moveaxis(_standing(model, *solved), -1, 0)
    if not (kappa > 0.0).all():
        return None
    omega = np.sqrt(kappa / inertia)
    share = rotation_kernel.rotation_of(platform)[rotation_kernel.INERTIA] / inertia
    steps = len(position_m)
    swing_rad = _swing_rad(*(_between(values, steps) for values in (psi, omega, share)))
    swing_m = float((swing_rad * reach[-1]).max())
    slowest, fastest = (float(x) / math.tau for x in (omega.min(), omega.max()))
    return FreeRotation(slowest, fastest, float(swing_rad.max()), swing_m)


def _along(ways: FloatArray, speed: float, most: float) -> tuple[FloatArray, FloatArray]:
    """Return positions and accelerations (steps, m, 2) along straight lines (m, 2, 2) from rest.

    Speed is trapezoidal, with the longer direction at its bounds, and averaged over SHAPING_s.
    """
    way = ways[:, 1] - ways[:, 0]
    far = np.abs(way).max(axis=1)
    top = np.minimum(speed, np.sqrt(most * far))
    speeding_s, whole_s = top / most, far / top + top / most
    averaged = max(1, round(rotation_kernel.SHAPING_s / _SWING_STEP_S))
    steps = math.ceil(float(whole_s.max()) / _SWING_STEP_S) + averaged + 1
    t = _SWING_STEP_S * np.arange(steps)[:, None]
    velocity = np.minimum(np.minimum(most * t, top), np.maximum(most * (whole_s - t), 0.0))
    speeding = np.where(t < speeding_s, most, 0.0)
    slope = speeding - np.where((t >= whole_s - speeding_s) & (t < whole_s), most, 0.0)
    place = np.minimum(np.cumsum(velocity, axis=0) * _SWING_STEP_S, far)
    share = way / far[:, None]
    place, slope = (_averaged(values, averaged)[..., None] * share for values in (place, slope))
    return ways[:, 0] + place, slope


def _averaged(values: FloatArray, count: int) -> FloatArray:
    """Return the mean (steps, m) over the last `count` steps; all earlier values are 0."""
    total = np.cumsum(values, axis=0)
    total[count:] -= total[:-count].copy()
    return total / count


def _standing(
    model: PlatformModel, position_m: FloatArray, acceleration_m_s2: FloatArray
) -> FloatArray:
    """Return ψ, κ, I_s and the farthest anchor point (steps, m, 4) under the planned tensions.

    κ is 0 if the platform turns over.
    """
    low, high = model.low_N + model.reserve_N, model.high_N - model.reserve_N
    planned, still = model.least_tensions(low, high), model.workspace(0.0)
    flat = position_m.reshape(-1, 2)
    wrenches = still.wrenches[0] - model.platform.mass_kg * acceleration_m_s2.reshape(-1, 2)
    t, rotation = np.zeros(model.kinematics.n), rotation_kernel.rotation_of(model.platform)
    found = np.zeros((len(flat), 4))
    poses = model.poses(flat)
    wrenches = wrenches + still.hanging_wrenches(poses)
    for k, W in enumerate(still.wrench_matrices(poses)):
        planned.solve(W, wrenches[k], t)
        found[k, 0] = rotation_kernel.turn_to_rest(model.kinematics.geometry, t, poses[k], rotation)
        if rotation[rotation_kernel.STEEPNESS] > 0.0:
            found[k, 1:] = rotation[
                [rotation_kernel.STIFFNESS, rotation_kernel.SWINGING, rotation_kernel.REACH]
            ]
    return found.reshape(*position_m.shape[:-1], 4)


def _between(values: FloatArray, steps: int) -> FloatArray:
    """Return values (solved, m) interpolated linearly between solutions, (steps, m)."""
    place = np.arange(steps) / _SOLVED_EVERY
    solved = np.arange(len(values))
    return np.stack([np.interp(place, solved, column) for column in values.T], axis=-1)


def _swing_rad(psi: FloatArray, omega: FloatArray, share: FloatArray) -> FloatArray:
    """Return the amplitudes (m,) that motions ψ (steps, m) leave, without damping.

    `share` (steps, m) is I/I_s.
    """
    moved = np.diff(psi, axis=0, prepend=psi[:1])
    swung, rate = np.zeros((2, psi.shape[1]))
    for k in range(len(psi)):
        rate -= _SWING_STEP_S * omega[k] ** 2 * swung
        swung += _SWING_STEP_S * rate - share[k] * moved[k]
    return np.asarray(np.hypot(swung, rate / omega[-1]))
