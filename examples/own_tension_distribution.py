"""Carry the platform of planar-3 with a tension distribution of your own.

You see the tensions at rest, first with the built-in distribution, then with one that keeps the
cables near 90 N, which makes the platform stiffer. The robot checks them: tensions out of their
bounds or out of equilibrium are a fault.
"""

import numpy as np

import cdpr_rt as cdpr

WANTED_N = 90.0


def near_wanted(
    W: np.ndarray, w: np.ndarray, low: np.ndarray, high: np.ndarray, _previous: np.ndarray
) -> np.ndarray:
    """Return the tensions nearest to WANTED_N with W t + w = 0.

    If one is out of its bounds, the worst is put on its bound and the others are computed again.
    """
    t, free = np.full(low.size, WANTED_N), np.full(low.size, True)
    while True:
        t[free] = WANTED_N
        t[free] -= np.linalg.pinv(W[:, free]) @ (W @ t + w)
        outside = np.maximum(low - t, t - high)
        worst = outside.argmax()
        if outside[worst] <= 0.0 or free.sum() <= len(w):
            return t
        t[worst] = np.clip(t[worst], low[worst], high[worst])
        free[worst] = False


def main() -> None:
    """Compare the tensions, computed offline and on the simulated robot."""
    place = [0.3, 1.8]
    for name, distribution in (("built-in", None), ("near_wanted", near_wanted)):
        model = cdpr.load("planar-3", tension_distribution=distribution)
        print(f"{name}: {model.tensions(place).round()} N computed")
        with cdpr.simulate("planar-3", tension_distribution=distribution) as robot:
            robot.enable()
            robot.tighten()
            robot.move_to(place)
            log = robot.log("pose", "pose_setpoint", "tension_N")
            off_m = np.linalg.norm((log["pose"] - log["pose_setpoint"])[:, :2], axis=1)
            print(f"{name}: {log['tension_N'][-1].round()} N on the robot,", end=" ")
            print(f"at most {1e3 * np.nanmax(off_m):.1f} mm off")


if __name__ == "__main__":
    main()
