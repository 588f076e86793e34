"""Simulated load cells in a process of their own, on a board that the test writes."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path
from typing import Any, Self

from sim_bus.physics_board import PhysicsBoard


class LoadCellRig:
    """`cdpr sim tension` and the physics it reads; `tell` breaks and mends things."""

    def __init__(self, sensors: str | Path, folder: Path, axes: int, *options: str) -> None:
        self.board = PhysicsBoard.create(folder / "board", axes)
        self.pull([0.0] * axes)
        command = ["sim", "tension", str(sensors), "--board", str(self.board.path)]
        self.process = subprocess.Popen(
            [sys.executable, "-m", "tools.cli", *command, "--exit-with-stdin", *options],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )
        self.port = str(self._answer()["ready"]["port"])

    def pull(self, tensions_N: list[float]) -> None:
        for i, tension in enumerate(tensions_N):
            self.board.axis(i).publish(0.0, tension, 0.0, 0.0, False)

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
        self.process.communicate(timeout=20)
        self.board.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()
