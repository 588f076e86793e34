"""Simulated load cells in a separate process, on a physics board that the test writes."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path
from typing import Any, Self

from cdpr_sim_bus.physics_board import PhysicsBoard

_STEP_S = 1e-3


class LoadCellRig:
    """`cdpr sim tension` and the physics board that it reads. `tell` causes and ends faults."""

    def __init__(
        self, sensors: str | Path, folder: Path, axes: int, *options: str, lockstep: bool = False
    ) -> None:
        self.board = PhysicsBoard.create(folder / "board", axes, lockstep=lockstep)
        self.time_s = 0.0
        self._axes = [self.board.axis(i) for i in range(axes)]
        self.pull([0.0] * axes)
        command = ["sim", "tension", str(sensors), "--board", str(self.board.path)]
        self.process = subprocess.Popen(
            [sys.executable, "-m", "cdpr_tools.cli", *command, "--exit-with-stdin", *options],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )
        self.port = str(self._answer()["ready"]["port"])

    def pull(self, tensions_N: list[float], seconds: float = 0.4) -> None:
        """Apply these tensions for `seconds` of the board's time."""
        for _ in range(round(seconds / _STEP_S)):
            self.time_s += _STEP_S
            for axis, tension in zip(self._axes, tensions_N, strict=False):
                axis.publish(self.time_s, tension, 0.0, 0.0, False)

    def tell(self, text: str) -> dict[str, Any]:
        assert self.process.stdin is not None
        self.process.stdin.write(text + "\n")
        self.process.stdin.flush()
        return self._answer()

    def _answer(self) -> dict[str, Any]:
        assert self.process.stdout is not None
        answer: dict[str, Any] = json.loads(self.process.stdout.readline())
        return answer

    def close(self) -> None:
        self.process.communicate(timeout=120)
        self.board.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()
