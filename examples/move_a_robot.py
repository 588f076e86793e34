"""Move the planar robot around a square on simulated drives, and plot what was recorded.

You see the path of the platform beside its set-point, and the three cable tensions over time. The
picture is written to the file that you name, by default move_a_robot.png.
"""

import sys

import matplotlib as mpl

mpl.use("Agg")  # a file is written, no window opens

import matplotlib.pyplot as plt

import cdpr_rt as cdpr

CORNERS_M = [(-0.3, 1.6), (0.3, 1.6), (0.3, 2.2), (-0.3, 2.2), (-0.3, 1.6)]


def main(picture: str) -> None:
    """Run the robot, then draw its log."""
    with cdpr.simulate("planar-3") as robot:
        robot.enable()
        robot.tighten()
        robot.move_to(CORNERS_M[0])
        begun_s = robot.time_s
        for corner in CORNERS_M[1:]:
            robot.move_to(corner)
        print(f"{robot.name}: {robot.state} at {robot.position_m.round(4)} m")
        print(f"tensions {robot.tension_N.round(1)} N after {robot.time_s:.1f} s of bus time")
        log = robot.log()
    log = log[log["time_s"] >= begun_s]

    _, (path, tensions) = plt.subplots(1, 2, figsize=(10, 4), layout="constrained")
    path.plot(log["pose_setpoint"][:, 0], log["pose_setpoint"][:, 1], label="set-point")
    path.plot(log["pose"][:, 0], log["pose"][:, 1], label="platform")
    path.set(xlabel="x in m", ylabel="y in m", aspect="equal")
    tensions.plot(log["time_s"], log["tension_N"], label=robot.axes)
    tensions.set(xlabel="bus time in s", ylabel="tension in N")
    for axes in (path, tensions):
        axes.legend()
    plt.savefig(picture)
    print(f"wrote {picture}")


if __name__ == "__main__":
    main(sys.argv[1] if len(sys.argv) > 1 else "move_a_robot.png")
