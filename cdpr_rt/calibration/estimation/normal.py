"""Normal equations in blocks: parameters, and poses that each know only themselves.

    H = Σ Jp^T Jp + prior    E_j = Jp_j^T Jx_j    C_j = Jx_j^T Jx_j

Poses are eliminated: S = H - Σ E_j C_j^-1 E_j^T (Schur).
"""

from __future__ import annotations

import numpy as np
from scipy.linalg import cho_factor, cho_solve

from cdpr_rt.arrays import FloatArray
from cdpr_rt.calibration.camera.corner_terms import CornerNormals
from cdpr_rt.calibration.estimation.residuals import Linearised

_WEAK, _SINGULAR = 1e-6, 1e-10
_UNIT = 0.05
"""Change of a parameter, m and rad, that counts as large whatever was known of it before."""


class NormalEquations:
    """Of weighted rows of poses, and of corners of markers, in units of what is known before."""

    def __init__(
        self,
        at: Linearised,
        known_std: FloatArray,
        prior: FloatArray,
        corners: CornerNormals | None,
        free: tuple[int, ...],
        taken_out: FloatArray,
    ) -> None:
        """Take rows whose parameters come first, those of corners after them; (P,) in all.

        `taken_out` (P,) is information about single parameters that is none.
        """
        size, first = known_std.size, at.by_parameter.shape[2]
        self._scale, self._size = known_std, size
        scaled = at.by_parameter * known_std[:first]
        turned, across = np.swapaxes(scaled, 1, 2), np.swapaxes(at.by_pose, 1, 2)
        self._C = across @ at.by_pose
        self._gx = (across @ at.residual[..., None])[..., 0]
        # products of each pose alone are too small for BLAS to start threads, which cost more than
        # they bring
        H = (turned @ scaled).sum(axis=0)
        E = turned @ at.by_pose
        gp = (turned @ at.residual[..., None]).sum(axis=0)[:, 0]
        if corners is None:
            self._H, self._E, self._gp = H + np.eye(size), E, gp + prior
        else:
            own, chosen = known_std[first:], list(free)
            self._C += corners.C[:, chosen][:, :, chosen]
            self._gx += corners.by_pose[:, chosen]
            self._H, self._gp = np.eye(size), prior.copy()
            self._E = np.empty((len(E), size, len(chosen)))
            self._H[:first, :first] += H
            self._H[first:, first:] += corners.H * np.outer(own, own)
            self._E[:, :first] = E
            self._E[:, first:] = corners.E[:, :, chosen] * own[:, None]
            self._gp[:first] += gp
            self._gp[first:] += corners.by_parameter * own
        self._H[range(size), range(size)] -= taken_out * known_std**2
        d = self._C.shape[1]
        diagonal = self._C[:, range(d), range(d)]
        self._level = np.maximum(diagonal, _WEAK * (1.0 + diagonal.max()))

    def _reduced(self, damping: float) -> tuple[FloatArray, FloatArray, FloatArray]:
        P = self._size
        inverse = self.pose_covariance(damping)
        EC = self._E @ inverse
        S = self._H - np.tensordot(EC, self._E, axes=([0, 2], [0, 2]))
        S[range(P), range(P)] += damping * np.diag(self._H)
        return S, EC, inverse

    def pose_covariance(self, damping: float = 0.0) -> FloatArray:
        """Return C^-1 of each pose, (N, d, d); nothing in a direction that no row tells."""
        C, d = self._C.copy(), self._C.shape[1]
        if damping > 0.0:
            C[:, range(d), range(d)] += damping * self._level
            return np.asarray(np.linalg.inv(C))
        return np.asarray(np.linalg.pinv(C, rcond=_SINGULAR, hermitian=True))

    @property
    def across(self) -> FloatArray:
        """E, (N, P, d), by parameters in their own units."""
        return np.asarray(self._E / self._scale[:, None])

    def solve(self, damping: float) -> tuple[FloatArray, FloatArray, float]:
        """Return the change of parameters (P,), that of poses (N, d), and how large they are.

        The last is over what was known of a parameter before, or 5 cm and rad if that is less.
        """
        S, EC, inverse = self._reduced(damping)
        right = -self._gp + np.einsum("jpd,jd->p", EC, self._gx)
        try:
            y = cho_solve(cho_factor(S), right) if self._size else right
        except np.linalg.LinAlgError:
            y = np.zeros(self._size)
        moves = -(self._gx + np.einsum("jpd,p->jd", self._E, y))
        moves = np.einsum("jde,je->jd", inverse, moves)
        spread = np.sqrt(np.einsum("jd,jde,je->j", moves, self._C, moves))
        change = y * self._scale
        large = np.abs(change) / np.minimum(self._scale, _UNIT)
        size = max(float(large.max(initial=0.0)), float(spread.max(initial=0.0)) * 0.01)
        return change, moves, size

    def covariance(self) -> tuple[FloatArray, float]:
        """Return the covariance of the parameters, (P, P), and how many the observations tell."""
        if self._size == 0:
            return np.zeros((0, 0)), 0.0
        inverse = np.linalg.inv(self._reduced(0.0)[0])
        both = 0.5 * (inverse + inverse.T)
        told = float(self._size - np.trace(both))
        return np.asarray(both * np.outer(self._scale, self._scale)), told

    def left_of(self, at: Linearised) -> tuple[FloatArray, FloatArray]:
        """Return derivatives of rows by the parameters less what poses take of them, (N, R, P).

        And J_x C^-1, (N, R, d).
        """
        taken = at.by_pose @ self.pose_covariance()
        left = -(taken @ np.swapaxes(self.across, 1, 2))
        left[..., : at.by_parameter.shape[2]] += at.by_parameter
        return left, taken
