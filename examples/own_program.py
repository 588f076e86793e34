"""Move the platform of planar-3 on a circle with a program of your own.

You see how far the platform is from the circle, and a circle that is ended because it leaves the
workspace. In a daemon the same class is a command: `cdpr controller circle radius_m=0.2`.
"""

import numpy as np

import cdpr_rt as cdpr


class Circle(cdpr.Program):
    """A circle through the place where the platform is."""

    name = "circle"
    arguments = {"radius_m": (0.01, 0.8, 0.2), "round_s": (2.0, 60.0, 6.0)}  # low, high, default

    def begin(self, position: np.ndarray, radius_m: float, round_s: float) -> None:
        """Take the place at rest, (d,), and the arguments of the command."""
        self.radius_m, self.round_s = radius_m, round_s
        self.centre = position[:2] - [radius_m, 0.0]

    def target(self, time_s: float) -> np.ndarray | None:
        """Return the place after this time; None after one round."""
        if time_s > self.round_s:
            return None
        angle = 2.0 * np.pi * time_s / self.round_s
        return self.centre + self.radius_m * np.array([np.cos(angle), np.sin(angle)])


def main() -> None:
    """Run a circle, then one that is too large."""
    with cdpr.simulate("planar-3", programs=[Circle()]) as robot:
        robot.enable()
        robot.tighten()
        robot.move_to([0.2, 1.9])
        started_s = robot.time_s
        robot.run("circle", radius_m=0.2)
        log = robot.log("time_s", "pose")
        place_m = log["pose"][log["time_s"] > started_s, :2]
        off_m = np.abs(np.linalg.norm(place_m - [0.0, 1.9], axis=1) - 0.2)
        print(f"circle: at most {1e3 * off_m.max():.1f} mm off")
        try:
            robot.run("circle", radius_m=0.6)
        except cdpr.MotionEnded as error:
            print(f"ended: {error}")
        robot.wait(1.0)
        print(f"{robot.state}, {robot.program} at {robot.position_m.round(2)} m")


if __name__ == "__main__":
    main()
