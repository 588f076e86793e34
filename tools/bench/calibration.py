"""What the identification of a geometry costs, beside plain SciPy on the same equations."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any, Final

import numpy as np
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

from cdpr_profiles import load_robot
from cdpr_rt.arrays import FloatArray
from cdpr_rt.calibration.estimation.fit import fit
from cdpr_rt.calibration.estimation.parameters import EXIT, OFFSET, CableGeometry
from cdpr_rt.calibration.estimation.residuals import lengths_told
from cdpr_rt.calibration.readings.observations import Observations
from cdpr_tools.bench.timing import timed, verdict
from cdpr_tools.output import Output

ROBOT: Final = "spatial-8"
TARGET_ms: Final = 50.0
_EXIT_m, _NOISE_m, _SIGMA_m, _SIGMA_rad = 0.01, 3e-4, 1e-3, 2e-3


def measure(poses: int, repeats: int, images: int, seed: int, out: Output) -> dict[str, Any]:
    """Measure the fit of exit points and offsets with poses measured, and without.

    With so many images, also one with a camera.
    """
    file, true, seen = _made_up(poses)
    blind = seen.unmeasured()
    figures: dict[str, Any] = {"poses": poses, "target_ms": TARGET_ms}
    for name, what in (("measured", seen), ("redundancy", blind)):
        out.note(f"{name}: {poses} poses x {file.n} cables")
        taken, found = _timed(lambda what=what: fit(file, what), repeats)  # type: ignore[misc]
        figures[name] = {"ms": taken, "steps": found.steps, "off_mm": _off_mm(found.geometry, true)}
    figures["usual"] = _timed(lambda: fit(CableGeometry.of(load_robot(ROBOT)), seen), repeats)[0]
    out.note("the same with poses unknown by SciPy, numeric Jacobian")
    plain: list[FloatArray] = []
    cpu, _ = timed(lambda: plain.append(_plain(file, seen)), 1, 0)
    off_mm = _off_mm(file.with_values(plain[0][: file.size]), true)
    figures["scipy"] = {"ms": 1e-6 * float(cpu[0]), "off_mm": off_mm}
    figures["ratio"] = figures["scipy"]["ms"] / figures["measured"]["ms"]
    figures["reached"] = (
        max(figures[name]["ms"] for name in ("measured", "redundancy")) <= TARGET_ms
    )
    if images:
        from cdpr_tools.bench import joint_calibration  # noqa: PLC0415  # needs an extra

        figures["joint"] = joint_calibration.measure(images, seed, out)
    return figures


def report(figures: dict[str, Any]) -> list[str]:
    """Return the figures as lines."""
    lines = [
        f"{figures['poses']} poses x 8 cables, exit points and offsets, processor time:",
        *(
            f"  {text:34}{figures[name]['ms']:10.1f} ms, exit points "
            f"{figures[name]['off_mm']:.2f} mm off"
            for name, text in (
                ("measured", "poses measured"),
                ("redundancy", "poses unknown"),
                ("scipy", "SciPy, poses measured"),
            )
        ),
        f"  {'with drums and elongation too':34}{figures['usual']:10.1f} ms",
        f"  SciPy takes {figures['ratio']:.0f} times as long; wanted at most "
        f"{figures['target_ms']:g} ms: {verdict(figures['reached'])}",
    ]
    if joint := figures.get("joint"):
        lines += [
            f"{joint['images']} images of {joint['markers']} markers, {joint['corners']} corners, "
            "processor time:",
            f"  {'detection':34}{joint['detection_s']:10.2f} s",
            f"  {'map, joint fit, faults, verdict':34}{joint['fit_s']:10.2f} s, poses by lengths "
            f"{joint['position_mm']:.2f} mm and {joint['turn_deg']:.3f} deg off",
            f"  wanted at most {joint['target_s']:g} s: {verdict(joint['reached'])}",
        ]
    return lines


def _made_up(poses: int) -> tuple[CableGeometry, CableGeometry, Observations]:
    """Return the geometry of the file, the true one, and what would be read of that."""
    file = CableGeometry.of(load_robot(ROBOT), ("exit", "offset"))
    rng = np.random.default_rng(7)
    cable = file.cable.copy()
    cable[:, EXIT] = rng.normal(0.0, _EXIT_m, (file.n, 3))
    cable[:, OFFSET] = rng.normal(0.0, _EXIT_m, file.n)
    true, model = replace(file, cable=cable), file.model
    platform = model.platform
    places = rng.uniform(-1.0, 1.0, (poses, 6)) * 0.5 * platform.workspace_angle_rad
    places[:, :3] = rng.uniform(platform.workspace_min_m, platform.workspace_max_m, (poses, 3))
    at = model.poses(places)
    tension = np.tile(0.5 * (model.low_N + model.high_N), (poses, 1))
    lengths = lengths_told(true, at, tension) + rng.normal(0.0, _NOISE_m, (poses, file.n))
    turn = Rotation.from_rotvec(rng.normal(0.0, _SIGMA_rad, (poses, 3))).as_matrix()
    seen = Observations.of_lengths(lengths, tension, at)
    seen = seen.with_positions(at[:, 0] + rng.normal(0.0, _SIGMA_m, (poses, 3)), _SIGMA_m)
    return file, true, seen.with_rotations(turn @ at[:, 1:], _SIGMA_rad)


def _off_mm(found: CableGeometry, true: CableGeometry) -> float:
    return 1e3 * float(np.sqrt(((found.cable[:, EXIT] - true.cable[:, EXIT]) ** 2).mean()))


def _timed(work: Callable[[], Any], repeats: int) -> tuple[float, Any]:
    """Return the least processor time of some repetitions, ms, and what they find.

    All of it runs on one thread: that is the wall-clock time of a machine with nothing else to do.
    """
    cpu, _ = timed(work, repeats, warm_up=int(repeats > 1))
    return 1e-6 * float(cpu.min()), work()


def _plain(file: CableGeometry, seen: Observations) -> FloatArray:
    """Fit as one writes it first: all poses as unknowns, SciPy's own differences.

    Without priors, robust loss and covariance; tensions stretch the cables alike.
    """
    kernel, count, n = file.kernel_geometry(), seen.poses, file.n
    a, b = kernel[:3].T, kernel[3:6].T
    stretch = 1.0 + file.compliance() * seen.tension_N
    known = file.knowledge
    std = np.hypot(known.length_m, seen.length_m * file.compliance() * known.tension_N)

    def residuals(x: FloatArray) -> FloatArray:
        v, y = x[: 4 * n].reshape(n, 4), x[4 * n :].reshape(count, 6)
        Q = Rotation.from_rotvec(y[:, 3:]).as_matrix() @ seen.rotation
        c = y[:, None, :3] + np.einsum("jab,ib->jia", Q, b) - a - v[:, :3]
        off = (seen.length_m + v[:, 3]) * stretch - np.linalg.norm(c, axis=2)
        moved = (y[:, :3] - seen.position_m) / seen.position_std_m
        return np.concatenate(
            [(off / std).ravel(), moved.ravel(), (y[:, 3:] / seen.rotation_std_rad).ravel()]
        )

    first = np.concatenate(
        [np.zeros(4 * n), np.hstack([seen.position_m, np.zeros((count, 3))]).ravel()]
    )
    return np.asarray(least_squares(residuals, first, method="trf", max_nfev=20).x)
