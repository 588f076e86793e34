"""A command loads only the libraries it needs, because each costs startup time."""

from __future__ import annotations

import gc
import subprocess
import sys
from pathlib import Path

import pytest

from cdpr_tools import cli
from cdpr_tools.command_group import load
from cdpr_tools.commands import groups
from cdpr_tools.loading import without_collection


def _loaded(code: str) -> set[str]:
    """Return the modules that are loaded after `code` in a separate process."""
    told = subprocess.run(
        [sys.executable, "-c", f"{code}\nimport sys\nprint(*sys.modules)"],
        capture_output=True,
        text=True,
        check=True,
    )
    return set(told.stdout.split("\n")[-2].split())


@pytest.mark.parametrize(
    "modules",
    [cli.MODULES, groups.SIM, groups.DRIVE, groups.ROBOT],
    ids=["cdpr", "sim", "drive", "robot"],
)
def test_summaries_of_help_equal_those_of_the_commands(modules: dict[str, dict[str, str]]) -> None:
    for module, lines in modules.items():
        for name, line in lines.items():
            told = load(module, name).help
            assert " ".join(told.split("\n\n")[0].split()) == line


def test_help_loads_no_command() -> None:
    asked = "from cdpr_tools import cli; import sys; sys.argv = ['cdpr', '--help']\n"
    loaded = _loaded(asked + "try: cli.main()\nexcept SystemExit: pass")
    assert "cdpr_tools.cli" in loaded
    assert not {"numpy", "pydantic", "numba", "can", "cdpr_tools.commands.run"} & loaded


def test_other_commands_are_not_loaded() -> None:
    loaded = _loaded("from cdpr_tools.command_group import load; load('sim_up', 'up')")
    assert not {"pymodbus", "matplotlib", "fastapi", "httpx"} & loaded


def test_a_script_starts_the_simulator_before_it_loads_buses_and_kernels() -> None:
    assert not {"numba", "can", "canopen"} & _loaded("import cdpr_tools.simulate")


def test_kernels_do_not_load_scipys_linear_algebra_and_keep_it_usable() -> None:
    call = "import numba; assert numba.njit(lambda x: 2.0 * x)(2.0) == 4.0"
    loaded = _loaded(f"import cdpr_profiles.jit; {call}")
    assert "scipy.linalg" not in loaded
    assert "scipy.linalg.cython_blas" in _loaded("import cdpr_profiles.jit, scipy.optimize")


@pytest.mark.parametrize(
    "module", ["bus", "cogging", "commission", "profiles", "groups", "tension"]
)
def test_commissioning_and_simulation_need_no_daemon_packages(
    module: str,
) -> None:
    absent = "'fastapi httpx mcap pyarrow starlette uvicorn websockets zstandard'.split()"
    _loaded(
        f"import sys; sys.modules.update(dict.fromkeys({absent}))\n"
        f"import cdpr_tools.commands.{module}"
    )


FIRST = """
import os, pathlib, sys
import can, numba, numpy, pydantic, scipy.optimize, typer  # loaded once, because they are slow

for path in sorted(pathlib.Path(sys.argv[1]).rglob("*.py")):
    if "__name__ == " not in path.read_text() and path.parent.name != "commands":
        continue
    module = ".".join(("cdpr_tools", *path.relative_to(sys.argv[1]).with_suffix("").parts))
    child = os.fork()
    if child == 0:
        os._exit(not __import__(module))
    print(module, os.waitpid(child, 0)[1])
"""


def test_each_module_of_a_command_or_process_can_be_loaded_first() -> None:
    tools = str(Path(cli.__file__).parent)
    done = subprocess.run(
        [sys.executable, "-c", FIRST, tools], capture_output=True, text=True, check=False
    )
    codes = dict(line.split() for line in done.stdout.splitlines())
    assert {"cdpr_tools.commands.poses", "cdpr_tools.robots.workspace_border"} <= set(codes)
    assert set(codes.values()) == {"0"}, done.stderr


def test_no_garbage_is_collected_while_modules_load() -> None:
    with pytest.raises(ModuleNotFoundError), without_collection():
        assert not gc.isenabled()
        raise ModuleNotFoundError("a package")
    assert gc.isenabled()
