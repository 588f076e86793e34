"""The physics board is shared between processes and consistent. Invalid files are rejected."""

from __future__ import annotations

import multiprocessing
import platform
from pathlib import Path

import pytest

from cdpr_sim_bus.errors import BusSetupError
from cdpr_sim_bus.physics_board import BoardState, PhysicsBoard


def _write_until(path: Path, stop: float) -> None:
    board = PhysicsBoard.attach(path)
    axis = board.axis(1)
    number = 0.0
    while number < stop:
        number += 1.0
        axis.publish(number, 2.0 * number, 3.0 * number, 4.0 * number, True)
    del axis
    board.close()


def test_another_process_sees_consistent_states(tmp_path: Path) -> None:
    path = tmp_path / "board"
    with PhysicsBoard.create(path, 2) as board:
        axis = board.axis(1)
        writer = multiprocessing.get_context("spawn").Process(
            target=_write_until, args=(path, 300_000.0)
        )
        writer.start()
        seen = set()
        while writer.is_alive():
            state = axis.state()
            n = state.time_s
            assert state[1:4] == (2.0 * n, 3.0 * n, 4.0 * n)
            seen.add(n)
        writer.join()
        assert writer.exitcode == 0
        assert len(seen) > 5  # so few if both processes share one core
        assert axis.state() == BoardState(300_000.0, 600_000.0, 900_000.0, 1_200_000.0, True)
        assert board.axis(0).state().time_s == 0.0


def test_power_is_allowed_and_brakes_are_released_until_a_process_changes_them(
    tmp_path: Path,
) -> None:
    with PhysicsBoard.create(tmp_path / "board", 3) as board:
        one, other = board.axis(2), PhysicsBoard.attach(tmp_path / "board")
        assert one.power_allowed and one.brake_released and one.hung_mass_kg == 0.0
        other.axis(2).power_allowed = False
        other.axis(2).brake_released = False
        other.axis(2).hung_mass_kg = 2.5
        assert not one.power_allowed and not one.brake_released and one.hung_mass_kg == 2.5
        assert board.axis(1).power_allowed and board.axis(1).brake_released
        other.close()
    assert not (tmp_path / "board").exists()


def test_invalid_board_files_are_rejected_and_left_boards_replaced(tmp_path: Path) -> None:
    with pytest.raises(BusSetupError, match=r"No such file.*cdpr sim up"):
        PhysicsBoard.attach(tmp_path / "none")
    for content in (b"", b"short", b"x" * 1000):
        (tmp_path / "other").write_bytes(content)
        with pytest.raises(BusSetupError, match=r"physics board .*other"):
            PhysicsBoard.attach(tmp_path / "other")
    with pytest.raises(BusSetupError, match="not a physics board"):
        PhysicsBoard.create(tmp_path / "other", 1)  # never overwrite a file of something else
    assert (tmp_path / "other").read_bytes() == b"x" * 1000
    left = tmp_path / "left"  # left by a killed simulator
    PhysicsBoard.create(left, 1)
    with PhysicsBoard.create(left, 3) as board:
        assert board.axes == 3
    with pytest.raises(BusSetupError, match="No such file"):
        PhysicsBoard.create(tmp_path / "missing" / "board", 1)
    with (
        PhysicsBoard.create(tmp_path / "board", 1) as board,
        pytest.raises(IndexError, match="axis 1"),
    ):
        board.axis(1)


def test_a_processor_with_weak_memory_order_cannot_attach_to_a_board(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with PhysicsBoard.create(tmp_path / "board", 1):
        monkeypatch.setattr(platform, "machine", lambda: "aarch64")
        with pytest.raises(BusSetupError, match=r"board: .* processor is aarch64; .*x86_64"):
            PhysicsBoard.attach(tmp_path / "board")
        monkeypatch.setattr(platform, "machine", lambda: "x86_64")
        PhysicsBoard.attach(tmp_path / "board").close()
