"""How uncertain lengths and tensions were, by what they leave over: neither is known before.

Tensions t hold the platform: W t + w = 0, with the wrench matrix W and the weight's wrench w, which
is linear in the mass m and in m c. With W = U S V^T the d numbers S^-1 U^T (W t + w) of a pose have
the standard deviation of a tension.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from cdpr_rt.calibration.estimation.fit import Fit, fit
from cdpr_rt.calibration.estimation.parameters import CableGeometry
from cdpr_rt.robots.kinematics.cable_kernel import CABLE_ROWS, run_poses
from cdpr_rt.robots.workspace import G_m_s2

_LEAST_ROWS = 20
_LEAST_N, _MOST_N = 0.3, 10.0
_WEAK, _INERT = 1e-3, 1e-9
_LEAST_SHARE = 0.2
"""Of the standard deviation of a length that is taken before, to which the fit may take it."""


def tension_std_N(found: Fit) -> float | None:
    """Return the standard deviation of a tension, N, by the balance of the platform's forces.

    Mass and centre of mass are found with it. What pulls alike in all cables it does not see. None
    where hardly anything is left over; 0.3 to 10 N.
    """
    geometry, seen = found.geometry, found.seen
    there = seen.used.all(axis=1)
    poses, tension = found.poses[there], seen.tension_N[there]
    cables = np.empty((len(poses), CABLE_ROWS, geometry.n))
    run_poses(geometry.kernel_geometry(), poses, cables)
    chosen, up = list(geometry.model.kinematics.directions), geometry.coordinates - 1
    weight = np.zeros((len(poses), 6, 4))
    weight[:, up, 0] = -G_m_s2
    pull = np.zeros(3)
    pull[up] = -G_m_s2
    weight[:, 3:, 1:] = np.swapaxes(np.cross(np.swapaxes(poses[:, 1:], 1, 2), pull), 1, 2)
    U, s, _ = np.linalg.svd(-cables[:, chosen], full_matrices=False)
    told = s > _WEAK * s.max(initial=0.0)
    across = np.swapaxes(U, 1, 2) / np.maximum(s, _INERT)[..., None]
    pulled = (across @ -cables[:, chosen] @ tension[..., None])[..., 0][told]
    by_mass = (across @ weight[:, chosen])[told]
    mass, _, rank, _ = np.linalg.lstsq(by_mass, -pulled, rcond=_INERT)
    left = pulled + by_mass @ mass
    spare = left.size - int(rank)
    if spare < _LEAST_ROWS:
        return None
    return min(max(math.sqrt(float(left @ left) / spare), _LEAST_N), _MOST_N)


def with_noise_seen(found: Fit, file: CableGeometry) -> CableGeometry:
    """Return the robot's file with readings as good as a fit has found them to be.

    What encoders and torques are taken to be uncertain by is a guess for all robots. Tensions tell
    theirs by the balance of forces; they are not worse than lengths bear out. Where a camera tells
    poses, so much is left over of lengths that theirs is known as well, and lengths and corners
    are weighed rightly; it is made smaller only.
    """
    geometry = found.geometry
    known = geometry.knowledge
    soft = geometry.compliance_1_N * found.seen.length_m
    squares = float((soft**2).mean())
    variance = found.variance_factor * (known.length_m**2 + squares * known.tension_N**2)
    tension_N = tension_std_N(found) or known.tension_N
    if squares:
        most_N = math.sqrt(variance / squares) / (1.0 + geometry.elongation)
        tension_N = max(min(tension_N, most_N), _LEAST_N)
    length_m = known.length_m
    if found.camera is not None:
        rest = variance - squares * tension_N**2
        length_m *= math.sqrt(min(max(rest / length_m**2, _LEAST_SHARE**2), 1.0))
    return replace(file, knowledge=replace(known, length_m=length_m, tension_N=tension_N))


def fit_with_noise_seen(found: Fit, file: CableGeometry) -> tuple[Fit, CableGeometry]:
    """Return a fit with readings as good as they have shown to be, and the file with these."""
    weighed = with_noise_seen(found, file)
    again = replace(found.seen, start=found.poses)
    return fit(weighed, again, start=found.geometry, camera=found.camera), weighed
