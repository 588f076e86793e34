"""Robots simulated in the process of the test, which can run in a fork of such a robot."""

from __future__ import annotations

import ctypes
import gc
import os
import signal
import sys
import traceback
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import pytest

from cdpr_tools.lockstep_robot import LockstepRobot

_PR_SET_PDEATHSIG = 1


class LocalRobot(LockstepRobot):
    """A robot with its simulator in this process.

    A test that requests it as a fixture runs in a fork. What the test does to the robot, and to all
    else in memory, is lost with the fork. So a fixture of the whole file brings the robot to the
    start of all tests. Other fixtures must not move it, because they do not run in the fork.
    """

    def run_in_fork(self, item: pytest.Function) -> None:
        """Call the test's function in a fork of this process; fail here if it fails there."""
        self.simulator.before_fork()
        gc.collect()
        gc.freeze()
        with TemporaryDirectory(prefix="cdpr-fork-") as folder:
            told, tell = os.pipe()
            pid = os.fork()
            if not pid:
                self._be_the_fork(item, Path(folder), tell)
            os.close(tell)
            try:
                with os.fdopen(told) as pipe:
                    text = pipe.read()
            except BaseException:
                os.kill(pid, signal.SIGKILL)
                raise
            finally:
                status = os.waitstatus_to_exitcode(os.waitpid(pid, 0)[1])
        if status:
            pytest.fail(text or f"the fork ended with status {status}", pytrace=False)

    def _be_the_fork(self, item: pytest.Function, folder: Path, tell: int) -> None:
        status = 1
        try:
            ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGKILL, 0, 0, 0)
            self.simulator.after_fork(folder)
            self.folder = folder
            item.obj(**{name: item.funcargs[name] for name in item._fixtureinfo.argnames})
            status = 0
        except Exception:
            report = str(item.repr_failure(pytest.ExceptionInfo.from_current()))
            with os.fdopen(tell, "w") as pipe:
                pipe.write(report)
        except BaseException:
            traceback.print_exc()
        finally:
            sys.stdout.flush()
            sys.stderr.flush()
            os._exit(status)  # without the cleanup of the parent


@contextmanager
def local_robot(
    file: str | Path, *, plant: Path | None = None, **more: Any
) -> Iterator[LocalRobot]:
    """Yield a robot that is ready."""
    with LocalRobot(file, plant=plant, **more) as robot:
        yield robot
