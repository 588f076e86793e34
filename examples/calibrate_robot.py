"""Calibrate planar-4, whose cables leave elsewhere than its file says, and read the result.

You see the corrections of the exit points with their uncertainty, the true errors, and how far the
robot is off at unused poses before and after. In place of the simulated laser tracker read your
measuring device. For a real robot replace `cdpr.simulate(...)` by `cdpr.connect()`.
"""

import sys
from pathlib import Path

import numpy as np

import cdpr_rt as cdpr

ERRORS_MM = [[6.0, -4.0], [-5.0, 3.0], [4.0, 5.0], [-3.0, -6.0]]
TRACKER_STD_M = 0.0005


def main(folder: Path) -> None:
    """Calibrate into a folder, then read the results."""
    if folder.exists():
        sys.exit(f"{folder} exists: add the name of a new folder to the command")
    folder.mkdir()
    plant = folder / "plant.toml"
    errors_m = [[1e-3 * x for x in point] for point in ERRORS_MM]
    plant.write_text(f"[geometry]\nexit_errors_m = {errors_m}\n", encoding="utf-8")
    noise = np.random.default_rng(1)

    with cdpr.simulate("planar-4", plant=plant) as robot:

        def tracker(_by_cables_m: np.ndarray) -> np.ndarray:
            return robot.true_pose[:2] + noise.normal(0.0, TRACKER_STD_M, 2)

        robot.enable()
        robot.tighten()
        result = cdpr.calibrate(
            robot,
            measured=tracker,
            measured_std_m=TRACKER_STD_M,
            poses=15,
            identify=["exit", "offset"],
            known_exit_m=0.01,  # standard deviation of the exit points in the robot's file
            folder=folder / "run",
        )
        robot.lower()

    print(*result["verdict"], sep="\n")
    for row in result["parameters"]:
        print(f"{row['name']}: {row['change']:+.1f} ± {3.0 * row['std']:.1f} {row['unit']}")
    print(f"true errors of the exit points: {ERRORS_MM} mm")
    checked = result["verification"]
    before_mm = checked["mean_position_error_before_mm"]
    print(f"unused poses: {before_mm:.1f} mm off before, ", end="")
    print(f"{checked['mean_position_error_mm']:.1f} mm after")
    print(f"good: {result['good']}; report: {result['report']}")


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "calibrate_robot"))
