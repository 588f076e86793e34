"""Each example runs unchanged and prints what its docstring promises."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from threading import Timer
from typing import Any

import pytest
from fork_server import FORKED

pytestmark = pytest.mark.usefixtures("slower_profiles")
EXAMPLES = Path(__file__).parents[1] / "examples"
MOST_LINES = 60
PRINTED = {
    "move_a_robot.py": ["active at", "wrote "],
    "faults.py": [
        "refused: pose: position_m",
        "fault of limit 'drive'",
        "state fault",
        "state act",
    ],
    "own_controller.py": ["built-in controller: ", "PoseController: "],
    "own_program.py": ["circle: at most ", "ended: circle: at ", "active, hold at"],
    "own_tension_distribution.py": ["built-in: [", "near_wanted: [", "mm off"],
    "workspace.py": ["% of the grid can be held", "lowest tension", "wrote "],
    "drawing.py": ["drawing.csv: ", "drawing.nc: "],
    "teleoperate.py": ["mm at the end", "active, hold at"],
    "relative_moves_daemon.py": ["refused: pose: distance_m", "recorded", "the daemon has ended"],
    "calibrate_robot.py": ["unused poses: ", "good: True; report: "],
    "gym_environment.py": [" mm from the target after 2 s"],
}
RUN = "import runpy, sys; runpy.run_path(sys.argv.pop(1), run_name='__main__')"
NEEDED = {"gym_environment.py": "gymnasium"}
NOTEBOOK = EXAMPLES / "live_plot.ipynb"


def test_each_example_is_listed_and_has_at_most_60_lines() -> None:
    files = {path.name: path.read_text().count("\n") for path in EXAMPLES.glob("*.py")}
    assert files.keys() == {*PRINTED, "commission_motor.py"}  # tests/hil/test_commission.py
    cells = json.loads(NOTEBOOK.read_text())["cells"]
    files[NOTEBOOK.name] = sum(len(cell["source"]) for cell in cells)
    assert max(files.values()) <= MOST_LINES
    page = (EXAMPLES.parent / "docs" / "reference" / "examples.md").read_text()
    assert re.findall(r"\[`(\w+\.\w+)`\]\(\S+examples/\1\)", page) == sorted(files)


def run_example(name: str, folder: Path, printed: list[str]) -> None:
    """Run an example unchanged in a folder, and check that it succeeds and what it prints."""
    done = subprocess.run(
        [*FORKED, RUN, str(EXAMPLES / name)],
        cwd=folder,
        env={**os.environ, "XDG_RUNTIME_DIR": str(folder), "XDG_STATE_HOME": str(folder)},
        capture_output=True,
        text=True,
        timeout=300.0,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    for words in printed:
        assert words in done.stdout


@pytest.mark.long
@pytest.mark.parametrize("name", PRINTED)
def test_example_succeeds_and_prints_its_results(name: str, tmp_path: Path) -> None:
    if name in NEEDED:
        pytest.importorskip(NEEDED[name])
    run_example(name, tmp_path, PRINTED[name])
    if name == "move_a_robot.py":
        assert (tmp_path / "move_a_robot.png").stat().st_size > 10_000


@pytest.mark.parametrize("name", ["commission_motor", "calibrate_robot"])
def test_an_example_keeps_the_results_of_an_earlier_run(name: str, tmp_path: Path) -> None:
    (tmp_path / name).mkdir()
    done = subprocess.run(
        [sys.executable, str(EXAMPLES / f"{name}.py")],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        timeout=60.0,
        check=False,
    )
    wanted = f"{name} exists: add the name of a new folder to the command\n"
    assert (done.returncode, done.stderr) == (1, wanted)


@pytest.mark.long
def test_the_examples_pass_mypy_strict_as_a_users_code_does(tmp_path: Path) -> None:
    pytest.importorskip("gymnasium")
    names = [str(path) for path in EXAMPLES.glob("*.py")]
    checked = subprocess.run(
        [sys.executable, "-m", "mypy", "--strict", "--cache-dir", str(tmp_path), *names],
        cwd=tmp_path,  # away from this repository's settings
        capture_output=True,
        text=True,
        timeout=300.0,
        check=False,
    )
    assert checked.returncode == 0, checked.stdout


@pytest.mark.long
def test_the_gymnasium_environment_passes_the_check_of_gymnasium(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    pytest.importorskip("gymnasium")
    from gymnasium.utils.env_checker import check_env  # noqa: PLC0415  # an extra

    monkeypatch.syspath_prepend(EXAMPLES)
    from gym_environment import Reach  # noqa: PLC0415  # needs it too

    env = Reach()
    with warnings.catch_warnings():
        warnings.simplefilter("error")  # also for numbers that are repeated only nearly
        warnings.filterwarnings("ignore", message=".*platform (stands|may still swing)")
        check_env(env, skip_render_check=True)
    assert env.robot.state == "active"
    first_robot, start = env.robot, env.reset()[0]
    assert env.robot is first_robot  # moved back, not started again
    while not (ended := env.step(env.action_space.high)[2]):
        pass
    assert ended
    assert env.robot.state == "fault"
    again = env.reset()[0]
    assert env.robot is not first_robot
    assert max(abs(start[:2]).max(), abs(again[:2]).max()) < 0.12
    assert (again != start).any()
    env.close()


@contextmanager
def kernel(folder: Path) -> Iterator[Any]:
    """Run a notebook's kernel in a folder; yield the client of an empty notebook."""
    nbformat, nbclient = pytest.importorskip("nbformat"), pytest.importorskip("nbclient")
    pytest.importorskip("ipykernel")
    manager = pytest.importorskip("jupyter_client").KernelManager(kernel_name="python3")
    where = {"metadata": {"path": str(folder)}}
    book = nbformat.v4.new_notebook()
    client = nbclient.NotebookClient(book, km=manager, timeout=300, resources=where)
    with client.setup_kernel():
        yield client


def executed(client: Any, code: str) -> Any:
    """Execute a new cell; return its outputs as text."""
    nbformat = pytest.importorskip("nbformat")
    cell = nbformat.v4.new_code_cell(code)
    client.nb.cells.append(cell)
    client.execute_cell(cell, len(client.nb.cells) - 1)
    return "".join(output.get("text", "") for output in cell.outputs)


@pytest.mark.long
def test_the_notebook_plots_a_moving_robot(tmp_path: Path) -> None:
    nbformat = pytest.importorskip("nbformat")
    book = nbformat.read(NOTEBOOK, as_version=4)
    with kernel(tmp_path) as client:
        client.nb = book
        for index, cell in enumerate(book.cells):
            client.execute_cell(cell, index)
    plots = [out for cell in book.cells for out in cell.get("outputs", ()) if "data" in out]
    assert any("image/png" in out["data"] for out in plots)
    assert "active at [-0.3  1.6] m" in book.cells[-1].outputs[0]["text"]


@pytest.mark.long
def test_interrupting_the_kernel_lowers_the_platform_and_removes_the_power(tmp_path: Path) -> None:
    nbclient = pytest.importorskip("nbclient")
    with kernel(tmp_path) as client:
        executed(client, "import cdpr_rt as cdpr\nrobot = cdpr.simulate('planar-3')")
        for motion in ("robot.move_to([0.0, 2.2], speed_m_s=0.01)", "robot.wait(60)"):
            executed(client, "robot.enable(); robot.tighten(); robot.move_to([0.0, 1.6])")
            late = Timer(1.0, client.km.interrupt_kernel)
            late.start()
            with pytest.raises(nbclient.exceptions.CellExecutionError, match="KeyboardInterrupt"):
                executed(client, motion)
            late.join()
            told = executed(client, "print(robot.state, robot.true_pose[:2].round(3) + 0.0)")
            assert told == "ready [0.  1.3]\n"
