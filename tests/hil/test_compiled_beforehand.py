"""No kernel is compiled while a robot has power, because the loop would stand still meanwhile."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

from tests.slower_robot import slower_robot

SCRIPT = """
import sys
from numba.core.registry import CPUDispatcher
from cdpr_tools.lockstep_robot import LockstepRobot

def compiled():
    return {
        (module.__name__, name): len(kernel.signatures)
        for module in list(sys.modules.values())
        if getattr(module, "__name__", "").startswith(("cdpr_rt", "cdpr_drivers", "cdpr_tools"))
        for name, kernel in vars(module).items()
        if isinstance(kernel, CPUDispatcher)
    }

with LockstepRobot(sys.argv[1]) as robot:
    before = compiled()
    robot.enable()
    robot.carry_out("tighten", 30.0)
    robot.carry_out("pose", 30.0, position_m=[0.1, 1.5])
    robot.program("pose", stream=True)
    hand, place = robot.stream.sender(), [0.0, 0.0, 0.0]
    for _ in range(30):
        place[0] += 1e-4
        robot.turn(20)
        hand.answer_of(robot.stream.take(hand.packet(robot.now_s, place)))
    assert robot.loop.engine.program.progress()["accepted"] > 20
    robot.inject(1, 1, 0x7305)
    robot._turn_until(lambda: robot.loop.busy, 3.0, "a reaction")
    robot._turn_until(lambda: not robot.loop.busy, 60.0, "the power off")
    assert "7305h" in robot.loop.life.reason
    late = {name for name, count in compiled().items() if count != before.get(name)}
print(sum(before.values()), sorted(late))
"""


def test_no_kernel_is_compiled_between_the_first_power_and_a_fault(tmp_path: Path) -> None:
    """This needs a separate process, because other tests compile kernels too."""
    done = subprocess.run(
        [sys.executable, "-c", SCRIPT, slower_robot(tmp_path, "planar-3")],
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    kernels, _, late = done.stdout.strip().partition(" ")
    assert int(kernels) > 10
    assert late == "[]"
