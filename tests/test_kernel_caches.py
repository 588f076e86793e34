"""Cached machine code is valid until its kernel, a callee or a constant changes."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

pytestmark = pytest.mark.long

CALLEE = "from cdpr_rt.jit import jit\n\n@jit\ndef inner(x):\n    return x + {added}\n"
CALLER = """
from cdpr_rt.jit import jit
from kernels_callee import inner

@jit
def outer(x):
    return 10.0 * inner(x)

print(outer(1.0), sum(outer.stats.cache_hits.values()))
"""


def output_words(folder: Path, *words: str) -> list[str]:
    # without bytecode, which is not updated if a source changes twice in a second
    done = subprocess.run(
        [sys.executable, "-B", *words], cwd=folder, capture_output=True, text=True, check=True
    )
    return done.stdout.split()


def test_kernel_is_compiled_again_after_an_indirect_callee_in_another_folder_changed(
    tmp_path: Path,
) -> None:
    (tmp_path / "middle").mkdir()
    (tmp_path / "inner").mkdir()
    callee = tmp_path / "inner" / "kernels_callee.py"
    between = "from cdpr_rt.jit import jit\nfrom inner.kernels_callee import inner\n"
    (tmp_path / "middle" / "kernels_callee.py").write_text(
        f"{between}\n@jit\ndef middle(x):\n    return 2.0 * inner(x)\n"
    )
    text = CALLER.replace("kernels_callee import inner", "middle.kernels_callee import middle")
    (tmp_path / "caller.py").write_text(text.replace("inner(", "middle("))
    for added, found in ((1.0, "40.0"), (2.0, "60.0")):
        callee.write_text(CALLEE.format(added=added))
        assert output_words(tmp_path, "caller.py") == [found, "0"]
        assert output_words(tmp_path, "caller.py") == [found, "1"]


def test_a_symlinked_source_shares_the_cache_of_its_target(tmp_path: Path) -> None:
    (tmp_path / "itself").mkdir()
    (tmp_path / "itself" / "kernels_callee.py").write_text(CALLEE.format(added=1.0))
    (tmp_path / "linked").symlink_to("itself")
    ask = (
        "from kernels_callee import inner; inner(1.0); print(sum(inner.stats.cache_hits.values()))"
    )
    for name, found in (("itself", "0"), ("linked", "1")):
        folder = str(tmp_path / name)
        assert output_words(
            tmp_path, "-c", f"import sys; sys.path.insert(0, {folder!r}); {ask}"
        ) == [found]


CONSTANTS = """
from cdpr_profiles.jit import jit
import numbers_of_ours as ours
from numbers_of_ours import FACTOR, TABLE

@jit
def scaled(x):
    return FACTOR * x

@jit
def moved(x):
    return x + ours.OFFSET * TABLE[0]

@jit
def both(x):
    return scaled(x) + moved(x)

both(1.0)
print(*(sum(one.stats.cache_hits.values()) for one in (scaled, moved, both)))
print(scaled(1.0), moved(1.0), both(1.0))
"""
NUMBERS = """
import numpy as np
FACTOR, OFFSET, TABLE = {factor}, {offset}, np.array([{one}, 7])
"""


def test_a_changed_constant_recompiles_only_kernels_that_use_it(tmp_path: Path) -> None:
    """Constants may be imported by name or as attributes of a module. Comments do not matter."""
    numbers, kernels = tmp_path / "numbers_of_ours.py", tmp_path / "kernels.py"
    kernels.write_text(CONSTANTS)
    numbers.write_text(NUMBERS.format(factor=2.0, offset=1.0, one=1))
    output_words(tmp_path, "kernels.py")
    kernels.write_text("# a remark\n" + CONSTANTS)
    assert output_words(tmp_path, "kernels.py")[2:] == ["1", "2.0", "2.0", "4.0"]
    for factor, offset, one, found in (
        (3.0, 1.0, 1, ["0", "1", "0", "3.0", "2.0", "5.0"]),
        (3.0, 2.0, 1, ["1", "0", "0", "3.0", "3.0", "6.0"]),
        (3.0, 2.0, 2, ["1", "0", "0", "3.0", "5.0", "8.0"]),
    ):
        numbers.write_text(NUMBERS.format(factor=factor, offset=offset, one=one))
        assert output_words(tmp_path, "kernels.py") == found


UNWRITABLE = """
from pathlib import Path
from cdpr_profiles import user_folders
user_folders.temporary_folder = lambda: Path({temporary!r})
from cdpr_rt.jit import jit
import shutil, sys

@jit
def kernel(x):
    return x + 1.0

for spoilt in sys.argv[1:]:
    shutil.rmtree(spoilt)
    Path(spoilt).touch()
print(kernel(1.0), sum(kernel.stats.cache_hits.values()))
"""


def without_folders(
    folder: Path, temporary: str, *words: str | Path
) -> subprocess.CompletedProcess[str]:
    """Run a kernel in a folder that nobody can write to, for a user without a home folder."""
    script = folder / "kernel.py"
    script.write_text(UNWRITABLE.format(temporary=temporary))
    (folder / "__pycache__").touch()  # numba expects a folder here
    given = {"HOME": "/proc/nowhere", "PYTHONDONTWRITEBYTECODE": "1"}
    env = {k: v for k, v in os.environ.items() if k not in ("NUMBA_CACHE_DIR", "XDG_CACHE_HOME")}
    return subprocess.run(
        [sys.executable, str(script), *map(str, words)],
        env=env | given, capture_output=True, text=True, check=True,
    )  # fmt: skip


def test_cache_falls_back_to_a_private_temporary_folder(
    tmp_path: Path,
) -> None:
    for found in ("0", "1"):
        done = without_folders(tmp_path, str(tmp_path / "own"))
        assert done.stdout.split() == ["2.0", found]
        assert done.stderr.count("\n") == 1
        assert f"compiled kernels are kept in {tmp_path / 'own' / 'kernels'}" in done.stderr
    assert (tmp_path / "own").stat().st_mode & 0o777 == 0o700


@pytest.mark.parametrize("taken", [False, True])
def test_kernels_work_without_any_cache_folder(tmp_path: Path, taken: bool) -> None:
    temporary = tmp_path / "of-others"
    temporary.mkdir(mode=0o777)
    temporary.chmod(0o777)  # other users could write machine code there, which we would run
    where = str(temporary) if taken else "/proc/nowhere/own"
    done = without_folders(tmp_path, where)
    assert done.stdout.split() == ["2.0", "0"]
    assert done.stderr.count("\n") == 1 and "set NUMBA_CACHE_DIR" in done.stderr
    assert not list(temporary.iterdir())


def test_kernels_work_after_their_cache_folder_was_replaced_by_a_file(tmp_path: Path) -> None:
    done = without_folders(tmp_path, str(tmp_path / "own"), tmp_path / "own" / "kernels")
    assert done.stdout.split() == ["2.0", "0"]


HITS = """
from cdpr_profiles import user_folders
from pathlib import Path
user_folders.temporary_folder = lambda: Path("/proc/nowhere/own")
from cdpr_rt.jit import jit

@jit
def kernel(x):
    return x + 1.0

print(kernel(1.0), sum(kernel.stats.cache_hits.values()))
"""


@pytest.mark.parametrize("home", ["home", "/proc/nowhere"])
def test_users_without_write_access_read_the_cache_beside_the_source(
    tmp_path: Path, home: str
) -> None:
    script = tmp_path / "tree" / "kernel.py"
    script.parent.mkdir()
    script.write_text(HITS)
    assert output_words(tmp_path, str(script)) == ["2.0", "0"]
    folders = [one for one in (script.parent, *script.parent.rglob("*")) if one.is_dir()]
    for folder in folders:
        folder.chmod(0o555)
    # drop root's right to write there
    weak = ["setpriv", "--bounding-set=-dac_override"] if os.geteuid() == 0 else []
    env = {k: v for k, v in os.environ.items() if k not in ("NUMBA_CACHE_DIR", "XDG_CACHE_HOME")}
    done = subprocess.run(
        [*weak, sys.executable, str(script)],
        env=env | {"HOME": str(tmp_path / home)}, capture_output=True, text=True, check=True,
    )  # fmt: skip
    for folder in folders:
        folder.chmod(0o755)
    assert (done.stdout.split(), done.stderr) == (["2.0", "1"], "")


AT_ONCE = """
import os, sys, time
from pathlib import Path
from cdpr_rt.jit import jit

@jit
def kernel(x):
    return x + x

mine, other = sys.argv[1:]
replace = os.replace

def slow_replace(source, target):
    if target.endswith(".nbi"):  # the index is about to be written
        Path(mine).touch()
        for _ in range(100):
            if Path(other).exists():
                time.sleep(0.5)
                break
            time.sleep(0.05)
    replace(source, target)

os.replace = slow_replace
kernel(1.0 if mine == "float" else 1)
print(sum(kernel.stats.cache_hits.values()))
"""


def test_cache_keeps_the_types_that_two_processes_compile_simultaneously(tmp_path: Path) -> None:
    """Each process writes the index only when the other one is about to write it too."""
    (tmp_path / "at_once.py").write_text(AT_ONCE)
    both = [["at_once.py", "float", "int"], ["at_once.py", "int", "float"]]
    running = [subprocess.Popen([sys.executable, *words], cwd=tmp_path) for words in both]
    assert [one.wait(60) for one in running] == [0, 0]
    assert [output_words(tmp_path, *words) for words in both] == [["1"], ["1"]]
