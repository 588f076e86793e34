"""Start a daemon on simulated drives, move its robot step by step, and end it.

You see the position after each relative move. While the script runs, `cdpr status` in another
terminal shows the robot, and `cdpr hold` stops it. At the end the daemon lowers the platform and
removes the power. For a daemon that runs already, replace `cdpr.run(...)` by `cdpr.connect()`.
"""

import cdpr_rt as cdpr

STEPS_M = [(0.05, 0.0), (0.0, 0.05), (-0.05, 0.0), (0.0, -0.05)]


def main() -> None:
    """Move the platform around a small square."""
    with cdpr.run("planar-3", bus="simbus:") as robot:
        robot.enable()
        robot.tighten()
        robot.move_to([0.0, 1.7])
        for step in STEPS_M:
            robot.move_by(step, speed_m_s=0.2)
            print(f"moved by {step} m: now at {robot.position_m.round(3)} m")
        try:
            robot.move_by([2.0, 0.0])
        except cdpr.Refused as refused:
            print(f"refused: {refused}")
        print(f"{robot.log().size} cycles were recorded")
    print("the daemon has ended")


if __name__ == "__main__":
    main()
