"""Control planar-3 with a controller of your own, and compare it with the built-in one.

You see how far the platform is from its target on the way, with the built-in controller and with 13
lines of NumPy. Both keep the limits: a controller that fails stops the robot.
"""

import numpy as np

import cdpr_rt as cdpr


class PoseController(cdpr.Controller):
    """PID control of the pose, on top of gravity and inertia."""

    def reset(self, state: cdpr.State) -> None:
        """Begin without an integral part."""
        self.integral = np.zeros_like(state.position)

    def update(self, state: cdpr.State, target: cdpr.Target) -> np.ndarray:
        """Return the tensions for a force that pulls the platform towards its target."""
        error = target.position - state.position
        self.integral += state.period_s * error
        force = 2000.0 * (error + self.integral) + 200.0 * (target.velocity - state.velocity)
        return state.distribute(force)


def error_mm(controller: cdpr.Controller | None) -> float:
    """Return the largest distance from the set-point on the way from side to side."""
    with cdpr.simulate("planar-3", controller=controller) as robot:
        robot.enable()
        robot.tighten()
        robot.move_to([-0.3, 1.8])
        started_s = robot.time_s
        robot.move_to([0.3, 1.8])
        log = robot.log()
        way = log[log["time_s"] > started_s]
        wanted, reached = way["pose_setpoint"][:, :2], way["pose"][:, :2]
        return float(1e3 * np.linalg.norm(reached - wanted, axis=1).max())


def main() -> None:
    """Run both."""
    print(f"built-in controller: {error_mm(None):.2f} mm off at most")
    print(f"PoseController: {error_mm(PoseController()):.2f} mm off at most")


if __name__ == "__main__":
    main()
