"""Machine code kept on disk is not used any more once a kernel that it calls has changed."""

from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path

import cdpr_sim_bus

CALLEE = "from cdpr_rt.jit import jit\n\n@jit\ndef inner(x):\n    return x + {added}\n"
CALLER = """
from cdpr_rt.jit import jit
from kernels_callee import inner

@jit
def outer(x):
    return 10.0 * inner(x)

print(outer(1.0), sum(outer.stats.cache_hits.values()))
"""
KERNEL_CACHE = "from cdpr_sim_bus import jit; print(jit._CACHE)"


def told(folder: Path, *words: str) -> list[str]:
    done = subprocess.run(
        [sys.executable, *words], cwd=folder, capture_output=True, text=True, check=True
    )
    return done.stdout.split()


def test_a_controllers_kernel_is_compiled_anew_when_its_callee_has_changed(tmp_path: Path) -> None:
    (tmp_path / "caller.py").write_text(CALLER)
    callee = tmp_path / "kernels_callee.py"
    callee.write_text(CALLEE.format(added=1.0))
    assert told(tmp_path, "caller.py") == ["20.0", "0"]
    assert told(tmp_path, "caller.py") == ["20.0", "1"]
    callee.write_text(CALLEE.format(added=2.0))
    assert told(tmp_path, "caller.py") == ["30.0", "0"]


def test_so_it_is_when_the_callee_is_in_another_folder(tmp_path: Path) -> None:
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
        assert told(tmp_path, "caller.py") == [found, "0"]
        assert told(tmp_path, "caller.py") == [found, "1"]


def test_machine_code_is_kept_once_by_whichever_path_its_source_is_found(tmp_path: Path) -> None:
    (tmp_path / "itself").mkdir()
    (tmp_path / "itself" / "kernels_callee.py").write_text(CALLEE.format(added=1.0))
    (tmp_path / "linked").symlink_to("itself")
    ask = (
        "from kernels_callee import inner; inner(1.0); print(sum(inner.stats.cache_hits.values()))"
    )
    for name, found in (("itself", "0"), ("linked", "1")):
        folder = str(tmp_path / name)
        assert told(tmp_path, "-c", f"import sys; sys.path.insert(0, {folder!r}); {ask}") == [found]


def test_the_simulators_kernels_have_a_cache_for_each_state_of_them(tmp_path: Path) -> None:
    package = tmp_path / "cdpr_sim_bus"
    shutil.copytree(Path(cdpr_sim_bus.__file__).resolve().parent, package)
    before = told(tmp_path, "-c", KERNEL_CACHE)
    assert told(tmp_path, "-c", KERNEL_CACHE) == before
    kernel = package / "robot" / "motor_physics.py"
    kernel.write_text(kernel.read_text() + "# changed\n")
    assert told(tmp_path, "-c", KERNEL_CACHE) != before
