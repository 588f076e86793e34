"""Reachable poses on `spatial-8`: their rate, and each way that was accepted looked at anew."""

from __future__ import annotations

import math
import time
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cdpr_profiles import load_robot
from cdpr_rt.robots.platform_model import PlatformModel, platform_model_of
from cdpr_rt.robots.reach.reach_kernel import CONTACT, NOT_HELD, WHOLE
from cdpr_rt.robots.reach.reachable import Reach
from cdpr_rt.robots.rigid_body import inertia_kg_m2
from cdpr_tools.bench.poses.brute import BruteMargin, BruteRobot
from cdpr_tools.bench.timing import verdict
from cdpr_tools.output import Output

Floats = NDArray[np.float64]
ROBOT = "spatial-8"
TARGET_1_s, THESIS_1_s = 10_000.0, 0.78
STEP_m = 1e-3
_TIMED, _WARM_UP, _BLOCKS = 4000, 64, 5
_COMPARED = 40
_STRETCHED, _TURNED_rad = 1.8, math.radians(60.0)
_G_m_s2 = 9.80665
_ROUNDING = 1e-7


def measure(ways: int, seed: int, out: Output) -> dict[str, Any]:
    """Measure the rate of poses, and look at `ways` ways far beyond the box of targets anew."""
    model = platform_model_of(load_robot(ROBOT))
    reach = Reach(model)
    out.note(f"{_BLOCKS} times {_TIMED} poses")
    times = [_draw_s(reach, seed + k) for k in range(_BLOCKS)]
    rate = _TIMED / float(np.median(times))
    drawn = reach.draw(_COMPARED, seed)
    brute = Brute(model)
    started = time.process_time()
    for position in drawn.positions:
        brute.is_free(reach.start, position, 1.0)
    plain = _COMPARED / (time.process_time() - started)
    out.note(f"{ways} ways anew at every {1e3 * STEP_m:g} mm; some 20 ms each")
    found = _look_anew(reach, brute, ways, seed)
    return {
        "robot": ROBOT,
        "poses_1_s": rate,
        "plain_numpy_1_s": plain,
        "over_plain_numpy": rate / plain,
        "over_thesis": rate / THESIS_1_s,
        "target_1_s": TARGET_1_s,
        **found,
        "reached": {
            "rate": rate >= TARGET_1_s,
            "no_false_acceptance": found["false_acceptances"] == 0,
        },
    }


def report(figures: dict[str, Any]) -> list[str]:
    """Return the figures as lines."""
    reached = figures["reached"]
    return [
        f"{figures['poses_1_s']:.0f} poses a second of processor time, wanted at least "
        f"{figures['target_1_s']:.0f}: {verdict(reached['rate'])}",
        f"{figures['over_plain_numpy']:.0f} times plain NumPy at every millimetre "
        f"({figures['plain_numpy_1_s']:.1f} a second), {figures['over_thesis']:.0f} times the "
        "thesis",
        f"of {figures['ways']} ways {figures['whole']} lead to their end, "
        f"{figures['cut_by_contact']} end at contact, {figures['cut_by_tensions']} where tensions "
        "do not hold",
        f"accepted, but not by brute force: {figures['false_acceptances']}, wanted 0: "
        f"{verdict(reached['no_false_acceptance'])}",
        f"ended more than 1 mm too soon: {figures['ended_1_mm_too_soon']}",
    ]


class Brute:
    """The same questions to plain NumPy, at places of a way."""

    def __init__(self, model: PlatformModel) -> None:
        platform = model.platform
        assert platform.body is not None
        exits, anchors = np.array(platform.exit_points_m), np.array(platform.anchor_points_m)
        Q = model.home_pose.Q
        body = np.array([platform.body.min_m, platform.body.max_m])
        obstacles = tuple(np.array([box.min_m, box.max_m]) for box in platform.obstacles)
        self.contact = BruteRobot(
            exits, anchors, platform.clearance_m, Q, body=body, obstacles=obstacles
        )
        weight = np.array([0.0, 0.0, -platform.mass_kg * _G_m_s2, 0.0, 0.0, 0.0])
        turning = platform.angular_acceleration_rad_s2 * (Q @ inertia_kg_m2(platform) @ Q.T)
        added = np.zeros((6, 6))
        added[:3, :3] = platform.mass_kg * platform.acceleration_m_s2 * np.eye(3)
        added[3:, 3:] = turning
        low, high = model.low_N + model.reserve_N, model.high_N - model.reserve_N
        centre = np.array(platform.centre_of_mass_m)
        self.margin = BruteMargin(exits, anchors, Q, centre, low, high, weight, added)
        self.arm_m = float(np.linalg.norm(anchors, axis=1).max())

    def is_free(self, start: Floats, end: Floats, share: float) -> bool:
        """Return whether all places of the way up to a share are held and clear, 1 mm apart."""
        length_m = np.linalg.norm((end - start)[:3]) + self.arm_m * np.linalg.norm(
            (end - start)[3:]
        )
        places = max(2, math.ceil(share * float(length_m) / STEP_m) + 1)
        return self.are_free(start + np.linspace(0.0, share, places)[:, None] * (end - start))

    def are_free(self, positions: Floats) -> bool:
        """Return whether all positions (m, 6) are held and clear."""
        p, phi = positions[:, :3], positions[:, 3:]
        apart = self.contact.clearances(p, phi)
        clear = min(float(each.min()) for each in apart.values())
        if clear < self.contact.clearance_m - _ROUNDING:
            return False
        return float(self.margin.margins(p, phi).min()) >= -_ROUNDING


def _draw_s(reach: Reach, seed: int) -> float:
    """Return the processor time of drawing poses."""
    reach.draw(_WARM_UP, seed)
    started = time.process_time()
    reach.draw(_TIMED, seed)
    return time.process_time() - started


def _look_anew(reach: Reach, brute: Brute, ways: int, seed: int) -> dict[str, Any]:
    """Return how many accepted parts of ways brute force refuses, and how many end too soon."""
    ends = far_ends(reach.model, ways, seed)
    shares, why = reach.shares(ends)
    false, soon = 0, 0
    for end, share, reason in zip(ends, shares, why, strict=True):
        false += not brute.is_free(reach.start, end, float(share))
        if reason != WHOLE:
            length = float(np.linalg.norm(end - reach.start))
            further = min(1.0, float(share) + STEP_m / length)
            soon += brute.are_free((reach.start + further * (end - reach.start))[None])
    return {
        "ways": ways,
        "whole": int((why == WHOLE).sum()),
        "cut_by_contact": int((why == CONTACT).sum()),
        "cut_by_tensions": int((why == NOT_HELD).sum()),
        "false_acceptances": false,
        "ended_1_mm_too_soon": soon,
    }


def far_ends(model: PlatformModel, count: int, seed: int) -> Floats:
    """Return positions (m, 6) in and far about the box of targets, turned up to 60 deg."""
    rng = np.random.default_rng(seed)
    low, high = np.array(model.platform.workspace_min_m), np.array(model.platform.workspace_max_m)
    half = 0.5 * _STRETCHED * (high - low)
    ends = np.zeros((count, 6))
    ends[:, :3] = 0.5 * (low + high) + rng.uniform(-half, half, (count, 3))
    turns = rng.normal(size=(count, 3))
    turns *= (_TURNED_rad * rng.uniform(0.0, 1.0, count) / np.linalg.norm(turns, axis=1))[:, None]
    ends[:, 3:] = turns
    return ends
