"""Draw where planar-3 can be held, and how the lowest tension changes along a line.

You see a map of the capacity margin: how far all cable tensions can stay from their limits. The
platform can be held where the margin is positive. Nothing is started and nothing moves. The picture
is written to the file that you name, by default workspace.png.
"""

import sys

import matplotlib as mpl

mpl.use("Agg")  # a file is written, no window opens

import matplotlib.pyplot as plt
import numpy as np

import cdpr_rt as cdpr


def main(picture: str) -> None:
    """Compute the margin on a grid around the box of targets."""
    model = cdpr.load("planar-3")
    low, high = model.box_m
    around = 0.5 * (high - low)
    x, y = (np.linspace(a, b, 60) for a, b in zip(low - around, high + around, strict=True))
    grid = np.stack(np.meshgrid(x, y), axis=-1)  # (60, 60, 2)

    margin_N = model.capacity_margin(grid)  # (60, 60)
    print(f"{100.0 * np.mean(margin_N >= 0.0):.0f} % of the grid can be held")

    line = np.linspace(low, high, 50)
    tension_N = model.tensions(line)  # (50, 3)
    print(f"lowest tension on the diagonal: {tension_N.min():.1f} N")

    _, (left, right) = plt.subplots(1, 2, figsize=(10.0, 4.0), layout="constrained")
    levels = np.linspace(0.0, margin_N.max(), 8)
    shown = left.contourf(x, y, margin_N, levels)
    plt.colorbar(shown, label="capacity margin (N)")
    left.set(xlabel="x (m)", ylabel="y (m)", aspect="equal")
    right.plot(1e3 * np.linalg.norm(line - low, axis=1), tension_N, label=model.cables)
    right.set(xlabel="distance along the diagonal of the box (mm)", ylabel="tension (N)")
    right.legend()
    plt.savefig(picture)
    print(f"wrote {picture}")


if __name__ == "__main__":
    main(sys.argv[1] if len(sys.argv) > 1 else "workspace.png")
