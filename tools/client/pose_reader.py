"""Lengths and tensions of a platform that a daemon holds, read from its status."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

import numpy as np

from cdpr_rt.arrays import FloatArray
from cdpr_rt.calibration.markers.sighting import Sighting
from cdpr_rt.procedures.calibration.measure_poses import Readings
from cdpr_tools.client.client import Daemon
from cdpr_tools.errors import WorkFailedError

_ASK_S, _SILENT_S = 0.02, 5.0
"""Between two questions, and after which a loop that does not turn is not waited for."""
_KEYS = ("cable_length_m", "tension_N", "position_rad")


class DaemonReader:
    """Reads a robot that a daemon runs, by its status; a `PoseReader`. Moves nothing.

    `image` is what takes one, given what lets time pass. All raise WorkFailedError where the
    platform is not held on its cables, as `Daemon.get` does otherwise.
    """

    def __init__(
        self,
        daemon: Daemon,
        m_per_rad: FloatArray,
        image: Callable[[Callable[[float], None]], Sighting | None],
    ) -> None:
        self._daemon, self._m_per_rad, self._image = daemon, m_per_rad, image
        self.counted_m = np.zeros(len(m_per_rad))
        """The lengths at which the motors' angles are zero, (n,), as last read."""

    def place(self) -> FloatArray:
        """Return where the platform is, (d,)."""
        progress = self.status()["program_progress"]
        return np.array([*progress["position_m"], *progress.get("rotation_rad", ())])

    def wait(self, seconds: float) -> None:
        """Let bus time pass."""
        self._rows(seconds)

    def read(self, seconds: float) -> Readings:
        """Let bus time pass and return what was read."""
        lengths, tensions, angles = self._rows(seconds).swapaxes(0, 1)
        if not np.isfinite([lengths, tensions]).all():
            raise WorkFailedError("not all lengths and tensions are known; run tighten first")
        self.counted_m = (lengths - self._m_per_rad * angles).mean(axis=0)
        return Readings(lengths, tensions)

    def image(self) -> Sighting | None:
        """Return what the camera sees, None without one."""
        return self._image(self.wait)

    def _rows(self, seconds: float) -> FloatArray:
        """Return lengths, tensions and angles (k, 3, n), two at least, while bus time passes."""
        status = self.status()
        begun_s = status["cycle"]["time_s"]
        rows: list[list[list[float | None]]] = []
        while status["cycle"]["time_s"] < begun_s + seconds or len(rows) < 2:
            rows.append([[axis[key] for axis in status["axes"]] for key in _KEYS])
            time.sleep(_ASK_S)
            status = self.status()
        return np.array(rows, float)

    def status(self) -> dict[str, Any]:
        """Return the daemon's status; raises WorkFailedError where the platform is not held."""
        status = self._daemon.get("/status")
        progress, silent_s = status["program_progress"], status["loop"]["silent_s"]
        if silent_s > _SILENT_S:
            raise WorkFailedError(f"the loop has not turned for {silent_s:.0f} s")
        if (
            status["state"] != "active"
            or progress.get("tight") is False
            or "position_m" not in progress
        ):
            raise WorkFailedError(
                f"the platform is not held on its cables ({status['state']}, "
                f"{status['program']}); allowed: after `cdpr enable`, `cdpr tighten`, `cdpr move`"
            )
        return status
