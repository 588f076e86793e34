"""G-code as a CAM program writes it: short lines along wavy contours, arcs, plunges, retracts."""

from __future__ import annotations

import math

import numpy as np

_LARGEST_mm, _SMALLEST_mm = 140.0, 20.0
_ARC_EVERY = 50
_ARC_mm = 8.0


def cam_program(lines: int, seed: int) -> str:
    """Return a program of so many lines: a pocket, level by level, contour by contour inward."""
    chance = np.random.default_rng(seed)
    out = ["%", "(pocket)", "G21 G90 G17 G94", "G0 Z50", "G0 X0 Y0"]
    level = phase = 0.0
    while len(out) < lines - 3:
        level -= 0.5
        phase += 0.3
        out += [f"G0 X{_LARGEST_mm:.3f} Y0", f"G1 Z{level:.3f} F600", "F6000"]
        out += _spiral(chance, phase, lines - 4 - len(out))
        out.append("G0 Z5")
    out = out[: lines - 3]
    return "\n".join([*out, "G0 Z50", "M2", "%", ""])


def _spiral(chance: np.random.Generator, phase: float, most: int) -> list[str]:
    """Return a contour that winds inward, 1 to 4 mm a line, a bulge of two arcs now and then."""
    out: list[str] = []
    radius, angle, count = _LARGEST_mm, 0.0, 0
    while radius > _SMALLEST_mm and len(out) < most:
        angle += 2.0 / radius * chance.uniform(0.5, 2.0)
        radius -= 0.012 * chance.uniform(0.5, 1.5)
        wavy = radius * (1.0 + 0.15 * math.sin(3.0 * angle + phase)) / 1.15
        x, y = wavy * math.cos(angle), wavy * math.sin(angle)
        out.append(f"G1 X{x:.3f} Y{y:.3f}")
        count += 1
        if count % _ARC_EVERY == 0 and len(out) + 2 <= most:
            out.append(f"G3 X{x - _ARC_mm:.3f} I{-0.5 * _ARC_mm:g} J0")
            out.append(f"G2 X{x:.3f} R{0.5 * _ARC_mm:g}")
    return out
