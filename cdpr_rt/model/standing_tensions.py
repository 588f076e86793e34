"""Tensions that tighten the cables of a standing platform without moving it."""

from __future__ import annotations

import numpy as np

from cdpr_rt.arrays import FloatArray
from cdpr_rt.model.platform_model import PlatformModel
from cdpr_rt.model.pose import Pose
from cdpr_rt.model.tension_distribution import TensionOutcome, TensionSolver

OVERSHOOT = 1.5
"""Ratio of the short overshoot to the pretension. When the tension falls again, friction acts in
the other direction, so its effect on the angles cancels."""
_CARRIED = 0.85 / OVERSHOOT
"""Share of the weight that the tensions carry if they cannot press the platform down."""
_HIGHEST = 0.9
_PRESSING, _MODEST = (0.5, 0.25, 0.0), 0.4
_FLOORS = (1.0, 0.75, 0.5, 0.25)
"""Shares of the range between least and planned tension, tried from the highest."""
_PRESSED_LESS, _SHARES = (0.75, 0.5), (1.0, 0.75, 0.5, 0.25, 0.0)
"""Shares of the weight that press a platform down whose cables might otherwise stay slack."""
_CLEAR, _CLEARED = 1.2, (1.0, 0.75, 0.5)
"""Tension, as a multiple of the winches' friction, below which a cable may be nearly slack while it
is wound in; and shares of this tension, tried from the highest."""


class StandingTensions:
    """Tensions (n,) at the winches under which a standing platform does not move.

    Their wrench is vertical. If moderate tensions can press the platform down, they do so. No
    tension is then below the least one. All tensions are as far above it as possible, up to the
    planned ones, because friction would otherwise let cables sag. If the friction of the winches
    may exceed these tensions, the wrench presses with less than the weight. The cables can then be
    pulled harder, if necessary harder than planned.

    If the cables cannot press the platform down, they carry 0.57 of its weight, which does not lift
    it even at the overshoot. Tensions exceed the friction of the winches if possible. Otherwise
    each is 0.57 of the tension that would carry the whole weight, which may be below the least
    tension. Friction changes tensions by some newtons, so a platform whose weight is nearly carried
    would not stand still. The weight includes that of the cables.
    """

    def __init__(
        self, model: PlatformModel, low_N: FloatArray, most_N: FloatArray, taken_up_N: FloatArray
    ) -> None:
        """Take the planned least tensions, and the highest tensions of the motors, (n,) each.

        `taken_up_N` (n,) is the friction of the winches, expressed as tensions of their cables.
        """
        self._kinematics, self._weight = model.kinematics, model.weight()
        self._most_N = most_N / OVERSHOOT
        least_N = model.low_N
        most = np.maximum(_HIGHEST * model.high_N / OVERSHOOT, 1.1 * least_N)
        modest = np.minimum(most, np.maximum(_MODEST * model.high_N, 1.1 * least_N))
        planned_N = np.minimum(low_N, 0.9 * most)
        floors_N = [least_N + share * (planned_N - least_N) for share in _FLOORS]
        self._least = model.least_tensions(least_N, most)
        pressing = model.least_tensions(least_N, modest)
        self._pressed = [(model.least_tensions(floor_N, most), 1.0) for floor_N in floors_N]
        self._clear_N = _CLEAR * taken_up_N
        self._clear = [
            (model.least_tensions(floor_N, most), share)
            for share in _PRESSED_LESS
            for floor_N in floors_N
            if (floor_N >= self._clear_N).all()
        ]
        # these exceed the friction of the winches, if necessary with more than the planned tension
        self._harder = [
            (part, model.least_tensions(np.clip(part * self._clear_N, least_N, most), most))
            for part in _CLEARED
        ]
        self._pressed += [(self._least, 1.0)] + [(pressing, share) for share in _PRESSING]
        self._carrying = model.least_tensions(np.zeros(least_N.size), model.high_N)
        self._W, self._t = np.zeros((model.size, least_N.size)), np.zeros(least_N.size)
        self._hanging, self._rise_N = np.zeros(model.size), np.zeros(least_N.size)

    def at(self, pose: Pose) -> tuple[FloatArray, bool]:
        """Return the tensions (n,) at a pose, and whether they leave the platform standing."""
        t = self._t
        self._look(pose)
        stays = self._press(self._pressed)
        if stays and (t < self._clear_N).any():
            exceeded = float(np.min(t / self._clear_N))
            stays = self._press(self._clear) or any(
                self._press([(solver, share) for share in _SHARES])
                for part, solver in self._harder
                if part > exceeded
            )
            stays = stays or self._press(self._pressed)
        elif not stays:
            stays = self._carry()
        t += self._rise_N
        # clipped tensions would exert another wrench
        stays = stays and bool((t <= self._most_N).all())
        return np.minimum(t, self._most_N, out=t), stays

    def _carry(self) -> bool:
        """Use tensions that carry a share of the weight; return whether such tensions exist."""
        t = self._t
        carried = self._weight + self._hanging
        stays = self._least.solve(self._W, carried, t) is TensionOutcome.FEASIBLE
        np.multiply(np.maximum(t, 0.0), _CARRIED, out=t)
        if (t >= self._clear_N).all():
            return stays
        least_N, harder = t.copy(), [(solver, -_CARRIED) for _, solver in self._harder]
        if self._press(harder):
            return True
        t[:] = least_N
        return stays

    def _press(self, tensions: list[tuple[TensionSolver, float]]) -> bool:
        """Use the first tensions that press the platform down by a share of its weight.

        Returns whether such tensions exist.
        """
        return any(
            solver.solve(self._W, self._hanging - share * self._weight, self._t)
            is TensionOutcome.FEASIBLE
            for solver, share in tensions
        )

    def carry(self, pose: Pose) -> bool:
        """Return whether nonnegative tensions within their bounds carry the weight."""
        self._look(pose)
        outcome = self._carrying.solve(self._W, self._weight + self._hanging, self._t)
        return outcome is TensionOutcome.FEASIBLE

    def _look(self, pose: Pose) -> None:
        """Compute the wrench matrix and the cables' weight at a pose."""
        self._kinematics.wrench_matrix(pose, self._W)
        self._hanging[:], self._rise_N[:] = self._kinematics.hanging(pose)
