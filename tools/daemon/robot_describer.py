"""Describes robots for the page in separate processes, so that the service is not delayed."""

from __future__ import annotations

import asyncio
import json
import time
from typing import Any, Final

from cdpr_rt.service.service import DescribingError
from cdpr_tools.processes import module_command_beside

_DESCRIBING: Final = "cdpr_tools.robots.describing"
_DESCRIBING_S, _IDLE_S = 90.0, 120.0
_MOST_WAITING: Final = 4
_ANSWER_BYTES: Final = 1 << 20


class RobotDescriber:
    """Describes robots in processes that stay for some time, because they take long to start.

    Diagnosis has a separate process, so that it does not delay the form.
    """

    def __init__(self, robot: str) -> None:
        self._robot = robot
        self._workers = {False: _DescribingProcess(), True: _DescribingProcess()}

    async def answer(self, request: dict[str, Any]) -> dict[str, Any]:
        """Return the answer to a request; raises DescribingError."""
        if request.get("present"):
            request = {**request, "present": self._robot}
        answer = await self._workers[bool(request.get("diagnose"))].answer(request)
        if "error" in answer:
            raise DescribingError(str(answer["error"]))
        return answer

    async def watch(self) -> None:
        """End the processes if they are idle, and at the end, when cancelled."""
        try:
            while True:
                await asyncio.sleep(_IDLE_S / 10)
                for worker in self._workers.values():
                    if worker.idle_s() > _IDLE_S:
                        worker.end()
        finally:
            for worker in self._workers.values():
                worker.end()


class _DescribingProcess:
    def __init__(self) -> None:
        self._process: asyncio.subprocess.Process | None = None
        self._turn = asyncio.Lock()
        self._waiting = 0
        self._used_s = 0.0

    def idle_s(self) -> float:
        """Return the time since the last answer, 0 while there is work."""
        return 0.0 if self._waiting else time.monotonic() - self._used_s

    def end(self) -> None:
        """End the process; the next request starts another."""
        process, self._process = self._process, None
        if process is not None and process.returncode is None:
            process.kill()

    async def answer(self, request: dict[str, Any]) -> dict[str, Any]:
        if self._waiting >= _MOST_WAITING:
            raise DescribingError("other robots are being described; try again")
        self._waiting += 1
        try:
            async with self._turn, asyncio.timeout(_DESCRIBING_S):
                return await self._exchange(json.dumps(request))
        except TimeoutError:
            self.end()
            raise DescribingError(
                f"this takes longer than {_DESCRIBING_S:g} s: is the machine busy? check values"
            ) from None
        except asyncio.CancelledError:  # its answer must not reach the next request
            self.end()
            raise
        except OSError as error:
            self.end()
            raise DescribingError(f"cannot be computed: {error.strerror}") from None
        finally:
            self._waiting -= 1
            self._used_s = time.monotonic()

    async def _exchange(self, line: str) -> dict[str, Any]:
        process = self._process
        if process is None or process.returncode is not None:
            process = self._process = await asyncio.create_subprocess_exec(
                *module_command_beside(_DESCRIBING),
                stdin=asyncio.subprocess.PIPE, stdout=asyncio.subprocess.PIPE,
                stderr=asyncio.subprocess.DEVNULL, limit=_ANSWER_BYTES,
            )  # fmt: skip
        assert process.stdin is not None and process.stdout is not None
        process.stdin.write(line.encode() + b"\n")
        answer = await process.stdout.readline()
        if not answer:
            self.end()
            raise DescribingError("the computation ended unexpectedly: out of memory?")
        found: dict[str, Any] = json.loads(answer)
        return found
