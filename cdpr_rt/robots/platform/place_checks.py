"""Where a platform can stand, and be led to: held by its cables, and in contact with nothing."""

from __future__ import annotations

import numpy as np

from cdpr_rt.arrays import FloatArray
from cdpr_rt.robots.kinematics import pose_setpoint
from cdpr_rt.robots.kinematics.pose import Pose, place_text
from cdpr_rt.robots.platform_model import PlatformModel
from cdpr_rt.robots.workspace import SHARES

_MOST_LOOKS = 200  # at the contacts of a way, between two cycles


class PlaceChecks:
    """Looks at places (d,), and at ways from the set-point, between two cycles."""

    position: FloatArray
    """The set-point, (d,), kept up to date by the control."""

    def __init__(self, model: PlatformModel) -> None:
        self.model = model
        self.workspace = model.workspace().prepared()
        """Where targets may lie."""
        self._interference = model.interference
        self._directions = np.array(model.kinematics.directions)
        self._home, self._to, self._place_scratch = (
            model.home_pose,
            Pose(np.zeros(3)),
            np.zeros((4, 3)),
        )

    def is_feasible(self, position: FloatArray) -> bool:
        """Return whether the platform can be held, and accelerated, at a position (d,)."""
        self._turn_to(position)
        return self.workspace.is_feasible(self._to)

    def contact_ahead(self, position: FloatArray) -> int:
        """Return a pair of things in contact on a short way from the set-point, -1 for none."""
        return self._interference.contact_ahead(self.position, position)

    def contact_at(self, position: FloatArray) -> int:
        """Return a pair of things in contact at a position (d,), -1 for none."""
        return self._interference.contact_at(self.position, position)

    def contact(self, pair: int) -> str:
        """Return in words that a pair is in contact."""
        return self._interference.within_clearance(pair)

    def infeasibility(self, position: FloatArray) -> str:
        """Return why the platform cannot stand at a position (d,), an empty text where it can.

        Tensions keep a reserve to their bounds there while it is accelerated in any direction.
        """
        self._turn_to(position)
        return self.workspace.infeasibility(self._to)

    def way_infeasibility(self, position: FloatArray, start: FloatArray | None = None) -> str:
        """Return what is in the straight way to a position (d,), an empty text for nothing.

        The way begins at `start` (d,), or where the set-point is.
        """
        share, begin = SHARES[:, None], self.position if start is None else start
        poses = self.model.poses((1.0 - share) * begin + share * position)
        obstacle = self.workspace.first_infeasible(poses)
        if obstacle is None:
            contact = self._interference.first_contact(np.array([begin, position]), _MOST_LOOKS)
            return "" if contact is None else str(contact)
        there, why = obstacle
        k = self.model.positions
        return f"{place_text(there.p[:k], k)}: {why}"

    def _turn_to(self, position: FloatArray) -> None:
        pose_setpoint.pose_of_coordinates(
            position, self._directions, self._home.array, self._place_scratch, self._to.array
        )
