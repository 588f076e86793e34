"""When a platform has come to where its set-point stands."""

from __future__ import annotations

NEAR_m, NEAR_SHARE = 5e-4, 1e-4
"""So near a platform has arrived, unless friction keeps it farther away; on a large robot, whose
long cables stretch and sag more, within this share of the diagonal of its frame."""
_NEAR_S = 0.2
_WAITED_S = 5.0


class Arrival:
    """Counts the cycles in which a set-point stands, and those in which the platform is near it.

    It is over once the platform has been within `near_m` for `near_s`, or the set-point has stood
    for `waited_s` without that.
    """

    def __init__(
        self,
        period_s: float,
        near_m: float = NEAR_m,
        near_s: float = _NEAR_S,
        waited_s: float = _WAITED_S,
    ) -> None:
        self.near_m = near_m
        self._near_cycles, self._most_cycles = round(near_s / period_s), round(waited_s / period_s)
        self._near = self._standing = 0
        self.off_m = 0.0
        """How far the platform was from its set-point in the last cycle."""

    def restart(self) -> None:
        """Begin anew, for a set-point that is to move."""
        self._near = self._standing = 0
        self.off_m = 0.0

    def update(self, standing: bool, off_m: float) -> None:
        """Count a cycle in which the set-point stands or not, the platform so far from it."""
        self._standing = self._standing + 1 if standing else 0
        self._near = self._near + 1 if standing and off_m < self.near_m else 0
        self.off_m = off_m

    @property
    def over(self) -> bool:
        """Whether there is nothing left to wait for."""
        return self._near > self._near_cycles or self._standing > self._most_cycles

    def text(self) -> str:
        """Return how far off the platform has stayed, an empty text where it is there."""
        if not self.over or self._near > self._near_cycles:
            return ""
        return f"the platform stands {1e3 * self.off_m:.1f} mm from its target"
