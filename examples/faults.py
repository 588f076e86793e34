"""Inject a drive fault into a move, handle it, and go on.

You see how the script learns of the fault, which limit and axis it names, and the steps back to a
moving robot: acknowledge, enable, tighten. A target out of the workspace is refused before anything
moves.
"""

import cdpr_rt as cdpr


def main() -> None:
    """Run the robot into a fault and out of it."""
    with cdpr.simulate("planar-3") as robot:
        robot.enable()
        robot.tighten()
        robot.move_to([0.0, 1.8])

        try:
            robot.move_to([0.0, 9.0])
        except cdpr.Refused as refused:
            print(f"refused: {refused}")

        robot.move_to([0.0, 1.5])
        robot.move_to([0.0, 1.8], speed_m_s=0.1, wait=False)
        robot.wait(0.5)
        robot.inject_fault("lower", "drive-fault")
        try:
            robot.wait_until_done()
        except cdpr.Faulted as fault:
            print(f"fault of limit {fault.limit!r}: {fault}")
        print(f"state {robot.state}")

        robot.acknowledge()  # the cause is gone: the simulated drive can be reset
        robot.enable()
        robot.tighten("home")  # somebody has looked: the platform has come down onto its stand
        robot.move_to([0.0, 1.8])
        print(f"state {robot.state}, at {robot.position_m.round(3)} m")


if __name__ == "__main__":
    main()
