"""Clearances of a robot's cables, platform and boxes, and the first contact on a straight line."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import Final

import numpy as np

from cdpr_rt.arrays import FloatArray, IntArray
from cdpr_rt.jit import bound
from cdpr_rt.model import contact_kernel as kernel
from cdpr_rt.model.cable_kernel import ANCHOR, CABLE_ROWS, RADIUS
from cdpr_rt.model.contact_kernel import (
    MOST_LOOKS,
    START,
    TURNED,
    WAY_ROWS,
    first_contact,
    nears,
)
from cdpr_rt.model.kinematics import CableKinematics
from cdpr_rt.model.pose import place_text

_PARTS: Final = 16
"""Number of parts in which a short way is checked."""
_EVERYWHERE_m: Final = 1e4
"""Depth of a planar robot's boxes on either side of the plane."""


@dataclass(frozen=True)
class Contact:
    """The first position on a way at which two bodies are closer than the clearance."""

    position: FloatArray
    """Position of the platform, (d,): coordinates, then rotation vector."""
    coordinates: int
    part: int
    """Index of the straight part in which the contact is."""
    share: float
    """Share of that part before the contact."""
    things: tuple[str, str]
    distance_m: float
    known: bool
    """True if the two bodies come this near, False if only the proof of clearance failed."""

    def __str__(self) -> str:
        text = in_words(self.things, self.distance_m)
        if not self.known:
            text += ", or the check takes too long; choose another way, or move in several steps"
        return f"{place_text(self.position, self.coordinates)}: {text}"


class Interference:
    """Contacts among cables, the platform's body and boxes of the room.

    Two things are in contact if they are closer than the clearance. A cable is the straight centre
    line of its free part, so the clearance has to cover its sag. Two bodies may share a point, or
    come closer than the clearance at an exit or anchor point. The cable is then not checked for a
    length of ten clearances from that point. In a planar robot the cables run in layers beside each
    other and the body, so they are checked against the boxes of the room only. An object must be
    used by one thread only.
    """

    def __init__(
        self,
        kinematics: CableKinematics,
        home: FloatArray,
        clearance_m: float,
        body: FloatArray | None = None,
        obstacles: Sequence[FloatArray] = (),
        planar: bool = False,
    ) -> None:
        """Take the pose at home (4, 3), and boxes (2, c): least and greatest coordinates."""
        self.clearance_m = clearance_m
        self._geometry, self._directions = kinematics.geometry, np.array(kinematics.directions)
        self._coordinates = sum(direction < 3 for direction in kinematics.directions)
        self._home = np.array(home, float)
        boxes = [np.zeros((2, 3)) if body is None else _in_space(body, 0.0)]
        boxes += [_in_space(box, _EVERYWHERE_m) for box in obstacles]
        self._boxes = np.array(boxes)
        self.pairs: IntArray = np.array(
            list(self._found_pairs(body is not None, planar)), np.int64
        ).reshape(-1, 4)
        """Array `pairs` of `contact_kernel`."""
        self.scene = kernel.Scene(
            self._geometry, self._boxes, self.pairs, clearance_m, kernel.TRIM_TIMES * clearance_m
        )
        self._way = np.zeros((WAY_ROWS, 3))
        self._way[0], self._way[4:] = self._home[0], self._home[1:]
        self._nears: Callable[[int], int] | None = None
        if len(self.pairs):
            self._first_contact = bound(first_contact, self.scene, self._way, then=(MOST_LOOKS,))
            n, corners = kinematics.n, np.abs(self._boxes[0]).max(axis=0)
            arms = np.linalg.norm([*self._geometry[ANCHOR:RADIUS].T, corners], axis=1)
            self._nears = bound(
                nears, self.scene, self._way, float(arms.max()), np.empty((CABLE_ROWS, n)),
                np.empty((2, 2, n, 3)), np.empty((3, 4, 3)), np.empty((5, 8, 3)),
                np.empty(len(self.pairs)), then=(_PARTS,),
            )  # fmt: skip

    def clearances(self, poses: FloatArray) -> tuple[FloatArray, IntArray]:
        """Return the least distances (m,), m, and their pairs, at poses (m, 4, 3).

        inf and -1 for a robot without possible contacts.
        """
        clearances, nearest = np.empty(len(poses)), np.empty(len(poses), np.int64)
        contiguous = np.ascontiguousarray(poses, float)
        kernel.write_clearances(self.scene, contiguous, clearances, nearest)
        return clearances, nearest

    def contact(self, pose: FloatArray) -> str:
        """Return the contact at a pose (4, 3) as text, or ""."""
        clearance, pair = self.clearances(pose[None])
        if clearance[0] >= self.clearance_m:
            return ""
        return in_words(self.things(int(pair[0])), float(clearance[0]))

    def contact_ahead(self, start: FloatArray, end: FloatArray) -> int:
        """Return a pair that comes into contact on a short straight line between positions (d,).

        Returns -1 for none. The method is meant for every cycle: it allocates no arrays, and may
        report contact if bodies only pass each other quickly and closely. A pair in contact at the
        start may separate.
        """
        return self._on_way(start, end, _PARTS)

    def contact_at(self, start: FloatArray, end: FloatArray) -> int:
        """Return a pair that is in contact at the end of a way, as for `contact_ahead`."""
        return self._on_way(start, end, 0)

    def _on_way(self, start: FloatArray, end: FloatArray, parts: int) -> int:
        if self._nears is None:
            return -1
        self._lead(start, end)
        return self._nears(parts)

    def within_clearance(self, pair: int) -> str:
        """Return a text that says which pair is in contact."""
        return in_words(self.things(pair), self.clearance_m)

    def first_contact(self, positions: FloatArray, looks: int = MOST_LOOKS) -> Contact | None:
        """Return the first contact on the straight lines between successive positions (m, d).

        The ways are straight in the coordinates of `PlatformModel`: position and rotation vector
        from home's orientation. The result is proved for all positions between, not sampled. A pair
        in contact at the start of a way must not come much nearer, and must be clear at its end. A
        pair that `looks` checks of a way do not prove clear counts as in contact.
        """
        for part in range(len(positions) - 1 if len(self.pairs) else 0):
            start, end = positions[part], positions[part + 1]
            self._lead(start, end)
            share, pair, distance, known = self._first_contact(looks)
            if pair >= 0:
                there = start + share * (end - start)
                things = self.things(pair)
                return Contact(there, self._coordinates, part, share, things, distance, known)
        return None

    def _lead(self, start: FloatArray, end: FloatArray) -> None:
        """Write the straight line from one position (d,) to another."""
        for k, direction in enumerate(self._directions):
            row, column = (START, direction) if direction < 3 else (TURNED, direction - 3)
            self._way[row, column], self._way[row + 1, column] = start[k], end[k] - start[k]

    def things(self, pair: int) -> tuple[str, str]:
        """Return the names of a pair's bodies."""
        kind, first, second, _ = (int(x) for x in self.pairs[pair])
        one = "platform" if kind == kernel.BODY_BOX else f"cable {first + 1}"
        if kind == kernel.CABLES:
            return one, f"cable {second + 1}"
        return one, "platform" if kind == kernel.CABLE_BODY else f"obstacle {second}"

    def _found_pairs(self, has_body: bool, planar: bool) -> Iterator[tuple[int, int, int, int]]:
        exits, anchors = self._geometry[:3].T, self._geometry[ANCHOR:RADIUS].T
        n, near = len(exits), self.clearance_m
        if not planar:
            for i, j in combinations(range(n), 2):
                shared = kernel.EXIT * bool(np.linalg.norm(exits[i] - exits[j]) < near)
                shared |= kernel.ANCHOR * bool(np.linalg.norm(anchors[i] - anchors[j]) < near)
                yield kernel.CABLES, i, j, shared
        if has_body and not planar:
            for i in range(n):
                inside = _outside_m(anchors[i], self._boxes[0]) < near
                yield kernel.CABLE_BODY, i, 0, kernel.ANCHOR * inside
        for k in range(1, len(self._boxes)):
            for i in range(n):
                pulley_m = 2.0 * float(self._geometry[RADIUS, i])
                inside = _outside_m(exits[i], self._boxes[k]) < near + pulley_m
                yield kernel.CABLE_BOX, i, k, kernel.EXIT * inside
            if has_body:
                yield kernel.BODY_BOX, 0, k, 0


def in_words(things: tuple[str, str], distance_m: float) -> str:
    """Return a text that says how near two bodies come to each other."""
    if all(thing.startswith("cable ") for thing in things):
        who = f"cables {things[0][6:]} and {things[1][6:]}"
    else:
        who = " and ".join(things)
    if not distance_m > 0.0:
        return f"{who} touch"
    return f"{who} come within {1e3 * distance_m:.0f} mm of each other"


def _in_space(box: FloatArray, deep_m: float) -> FloatArray:
    """Return a box with three coordinates; one in a plane extends by `deep_m` to either side.

    For a platform's body this must be small, because a deep body would sweep far when it turns.
    """
    given = np.asarray(box, float)
    in_space = np.array([[-deep_m] * 3, [deep_m] * 3])
    in_space[:, : given.shape[1]] = given
    return in_space


def _outside_m(point: FloatArray, box: FloatArray) -> float:
    return float(np.linalg.norm(point - np.clip(point, box[0], box[1])))
