"""Taking up the slack of a robot's cables, and learning where its platform is."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from cdpr_rt.exchange import AxisFeedback, FloatArray, Setpoint
from cdpr_rt.robots.planar_kernel import G_m_s2
from cdpr_rt.robots.planar_kinematics import PlanarGeometry
from cdpr_rt.robots.planar_tensions import PlanarTensions
from cdpr_rt.runtime.programs.base import ProgramError
from cdpr_rt.runtime.programs.platform_program import PlatformParts, PlatformProgram
from cdpr_rt.runtime.programs.reel import Reel
from cdpr_rt.runtime.programs.wanted import Wanted

REEL_m_s = 0.05
"""How fast slack comes in."""
GENTLE = 0.4
"""What cables are pulled with while some are slack, as a share of what they get."""
BEYOND = 1.5
"""How much harder they are pulled for a moment: coming back from there friction acts the other
way, and what it does to the angles on the way up and down cancels out."""
_HANGING = 0.8
_RISE_1_s = 1.0
_FALL_S = 0.2
_STILL_m = 0.0003
_STILL_S = 0.3
_PULLED = 0.95
_MOST_m = 1.0
_MOST_S = 60.0

_STAGES = (("slack", GENTLE), ("pull", 1.0), ("beyond", BEYOND), ("lengths", 1.0))
_SOURCES = ("home", "lengths")


class TightenProgram(PlatformProgram):
    """Pulls slack cables gently until all are tight and stand still; then keeps the platform.

    The platform stands firm meanwhile: tensions grow together, in shares whose sum presses it down
    where its cables can, and never pulls it sideways. Where cable lengths are not known, the
    platform is taken to be at home: it has to stand there. A cable that does not become tight ends
    it: the cables are let go again.
    """

    name = "tighten"
    needs_lease = True

    def __init__(self, parts: PlatformParts, torque_Nm: FloatArray, cable_m: FloatArray) -> None:
        super().__init__(parts, torque_Nm)
        self._cable = np.array(cable_m)
        self._full_N = np.minimum(standing_tensions(parts), torque_Nm / np.abs(cable_m) / BEYOND)
        inertia = np.full(3, parts.control.inertia_kg_m2)
        self._reel = Reel(inertia, cable_m, parts.period_s)
        self._reel.paying_out_m_s[:] = -REEL_m_s
        self._begun = np.zeros(3)
        self._up = np.zeros(3)
        self._here = np.zeros(3)
        self._stage = 0
        self._share = 0.0
        self._still = self._cycles = 0
        self._from_home = False
        self._tight = False
        self._why = ""

    def start(self, feedback: AxisFeedback, setpoint: Setpoint, torque_Nm: FloatArray) -> None:
        """Go on from the torque of the last cycle, whatever it pulled."""
        super().start(feedback, setpoint, torque_Nm)
        self._tight = self._parts.tight
        self._begun[:] = feedback.position_rad
        velocity = self._parts.estimator.estimate.velocity_rad_s
        self._reel.begin(feedback, velocity, torque_Nm)
        self._share = min(max(float(np.max(-torque_Nm / self._cable / self._full_N)), 0.0), 1.0)
        self._stage = self._still = self._cycles = 0
        self._from_home = not self._parts.known
        self._why = ""

    def update(self, feedback: AxisFeedback, setpoint: Setpoint, torque_Nm: FloatArray) -> None:
        """Write this cycle's set-point and torques, (3,) each, in place."""
        if self._tight:
            super().update(feedback, setpoint, torque_Nm)
            return
        goal = 0.0 if self._stopping else _STAGES[self._stage][1]
        step = self._parts.period_s * (1.0 / _FALL_S if self._stopping else _RISE_1_s)
        self._share += min(max(goal - self._share, -step), step)
        np.multiply(self._full_N, self._share, out=self._reel.high_N)
        self._reel.update(feedback, torque_Nm)
        setpoint.position_rad[:] = feedback.position_rad
        setpoint.velocity_rad_s[:] = setpoint.acceleration_rad_s2[:] = 0.0
        self._cycles += 1
        if self._stopping:
            self._at_rest = self._share == 0.0
        else:
            self._watch(feedback, setpoint, torque_Nm, self._share == goal)

    def progress(self) -> dict[str, Any]:
        """Return how far it is, how hard the cables are pulled, and what stands in the way."""
        told = {
            "stage": "held" if self._tight else _STAGES[self._stage][0],
            "tight": self._tight,
            "done": float(self._tight),
            "trouble": self._why,
        }
        if self._tight:
            return {**super().progress(), **told}
        return {"tension_N": self._reel.tension_N.tolist(), **told}

    def _parsed(self, wanted: Mapping[str, Any]) -> str:
        Wanted(self.name, wanted, ("from",))
        source = wanted.get("from", "lengths" if self._parts.known else "home")
        if source not in _SOURCES:
            allowed = " or ".join(_SOURCES)
            raise ProgramError(f"tighten: from: value {source!r}; allowed: {allowed}")
        if source == "lengths" and not self._parts.known:
            raise ProgramError("tighten: from: the cables' lengths are not known; allowed: home")
        return str(source)

    def _take(self, source: str) -> None:
        self._from_home = source == "home"

    def _watch(
        self, feedback: AxisFeedback, setpoint: Setpoint, torque_Nm: FloatArray, pulling: bool
    ) -> None:
        reel = self._reel
        moved_m = np.abs((feedback.position_rad - self._here) * self._cable).max()
        pulling = pulling and bool((reel.tension_N > _PULLED * reel.high_N).all())
        if not pulling or moved_m > _STILL_m:
            self._here[:] = feedback.position_rad
            self._still = 0
        self._still += 1
        if self._still * self._parts.period_s > _STILL_S:
            self._still = 0
            if _STAGES[self._stage][0] == "pull":
                self._up[:] = feedback.position_rad
            self._stage += 1
            if self._stage == len(_STAGES):
                self._finish(feedback, setpoint, torque_Nm)
            return
        self._why = self._trouble(feedback)
        self._stopping = bool(self._why)

    def _trouble(self, feedback: AxisFeedback) -> str:
        way = np.abs((feedback.position_rad - self._begun) * self._cable)
        most = int(way.argmax())
        if way[most] > _MOST_m:
            return f"cable {most}: {way[most]:.2f} m reeled in and not tight, {_MOST_m:g} m allowed"
        if self._cycles * self._parts.period_s > _MOST_S:
            return f"not tight within {_MOST_S:g} s"
        return ""

    def _finish(self, feedback: AxisFeedback, setpoint: Setpoint, torque_Nm: FloatArray) -> None:
        parts, control = self._parts, self._control
        self._stage -= 1
        if self._from_home:
            control.set_home(feedback, self._full_N)
            hysteresis = 0.5 * self._cable * (feedback.position_rad - self._up)
            parts.estimator.set_lengths(feedback.position_rad, control.free_lengths_m + hysteresis)
        self._tight = parts.tight = True
        super().start(feedback, setpoint, torque_Nm)
        self._parts.cycle = feedback.cycle


def standing_tensions(parts: PlatformParts) -> FloatArray:
    """Return tensions (3,) under which a platform at home stands firm on what it stands on.

    None is below the least. Together they press it down with its own weight, where some cable
    pulls downward; else they carry part of its weight.
    """
    platform = parts.platform
    geometry = PlanarGeometry(np.array(platform.exit_points_m), np.array(platform.anchor_points_m))
    J = geometry.jacobian(np.array(platform.home_m))
    weight = np.array([0.0, platform.mass_kg * G_m_s2])
    tensions = PlanarTensions(parts.control.least_N, parts.most_N / BEYOND)
    pressed, missing = tensions.distribute(J, weight)
    if not missing:
        return pressed
    hanging, _ = tensions.distribute(J, -weight)
    return np.maximum(_HANGING * hanging, 0.0)
