"""Lead the platform of planar-3 around a circle, by a stream of positions as from a hand.

You see how far the platform is behind the hand, which moves twice as far. In place of the circle
read your input device. For a daemon, use cdpr.run("planar-3", bus="simbus:").
"""

import numpy as np

import cdpr_rt as cdpr

RATE_HZ, SCALE, RADIUS_M, TURN_S = 60.0, 0.5, 0.3, 4.0


def hand_m(time_s: float) -> np.ndarray:
    """Return the position of the hand, (2,)."""
    angle = 2.0 * np.pi * min(time_s / TURN_S, 1.0)
    return RADIUS_M * np.array([np.sin(angle), 1.0 - np.cos(angle)])


def main() -> None:
    """Lead the platform for a turn and half a second."""
    with cdpr.simulate("planar-3") as robot:
        robot.enable()
        robot.tighten()
        robot.move_to([0.0, 1.7])
        begin, off_mm = robot.position_m, []
        with robot.stream(scale=SCALE) as send:  # the platform holds after this block
            for k in range(int(RATE_HZ * (TURN_S + 0.5))):
                send(hand_m(k / RATE_HZ))
                robot.wait(1.0 / RATE_HZ)
                led_m = begin + SCALE * hand_m(k / RATE_HZ)
                off_mm.append(1e3 * np.linalg.norm(robot.position_m - led_m))
        print(f"behind the hand by {max(off_mm):.0f} mm at most, {off_mm[-1]:.1f} mm at the end")
        print(f"{robot.state}, {robot.program} at {robot.position_m.round(3)} m")


if __name__ == "__main__":
    main()
