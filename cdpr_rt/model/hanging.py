"""Pose of a platform that hangs on too few cables, from its cable lengths and equilibrium."""

from __future__ import annotations

import numpy as np

from cdpr_rt.arrays import FloatArray
from cdpr_rt.model import equilibrium_kernel as kernel
from cdpr_rt.model.cable_kernel import CABLE_ROWS
from cdpr_rt.model.platform_model import PlatformModel
from cdpr_rt.model.pose import Pose

_MOST_STEPS = 60
_DONE_rad = 1e-9


def upward(tilt_rad: FloatArray) -> FloatArray:
    """Return the upward direction in the platform's frame, (3,), for roll and pitch (2,).

    The platform is turned by roll about its x, pitch about y and yaw about z: Q = Rz Ry Rx.
    """
    roll, pitch = tilt_rad
    return np.array([-np.sin(pitch), np.sin(roll) * np.cos(pitch), np.cos(roll) * np.cos(pitch)])


class HangingSearch:
    """Finds the pose of a platform at rest with the equations that the control uses."""

    def __init__(self, model: PlatformModel) -> None:
        """Take the model of a platform whose kinematics `hangs_freely`."""
        n = model.kinematics.n
        self._model, self._known = model, kernel.known_of(model.platform, model.reserve_N)
        self._tensions, self._cables = np.zeros((kernel.TENSIONS, n)), np.zeros((CABLE_ROWS, n))
        self._normal, self._rows = np.zeros((6 + n, 6 + n)), np.zeros((8, 6 + n))

    def find(
        self,
        lengths_m: FloatArray,
        start: Pose,
        tension_N: FloatArray | None = None,
        up: FloatArray | None = None,
    ) -> Pose | None:
        """Return the pose at which cables of these lengths (n,) hold the platform, or None.

        None means that the search has failed. `tension_N` (n,) are measured at the winches; without
        them, tensions are assumed to be close to those that the control plans. `up` (3,) is an
        inclinometer's upward direction in the platform's frame.
        """
        kinematics, known, tensions = self._model.kinematics, self._known, self._tensions
        # lengths do not agree at this rotation: a restart might find its mirror image
        found = kinematics.pose_from_lengths(lengths_m, start)
        weight = self._model.workspace(0.0, 0.0).wrenches[0]
        tensions_N, _ = self._model.planned_tensions(found.pose.array[None], weight[None])
        planned = np.ascontiguousarray(tensions_N[0])
        measured = np.full(kinematics.n, tension_N is not None)
        given = planned if tension_N is None else np.ascontiguousarray(tension_N, float)
        upward = np.zeros(4) if up is None else np.array([1.0, *up])
        tensions[kernel.FOUND] = given
        for _ in range(_MOST_STEPS):
            pose = Pose(found.pose.p, found.pose.Q)
            kernel.say_tensions(
                planned, given, measured, kinematics.geometry, self._cables, known, tensions,
                1.0,
            )  # fmt: skip
            angle = kernel.turn_to_equilibrium(
                kinematics.geometry, lengths_m, pose.array, self._cables, known, upward,
                tensions, self._normal, self._rows, 1.0,
            )  # fmt: skip
            found = kinematics.pose_from_lengths(lengths_m, pose)
            if angle < _DONE_rad and found.converged:
                return Pose(found.pose.p, found.pose.Q)
            if np.isnan(angle):
                return None
        return None
