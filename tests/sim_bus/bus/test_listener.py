"""Only the user who runs a simulated bus may join it.

If root runs the tests, uid 65534 is the other user. Otherwise no other user is available, and the
bus is made to believe that a different user runs it.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from typing import Any

import pytest

from cdpr_drivers.bus import query_status
from cdpr_drivers.errors import BusError

NOBODY = 65534


def join_as_nobody(name: str) -> str:
    """Return the answer to an unprivileged user who joins."""
    reader, writer = os.pipe()
    pid = os.fork()
    if pid == 0:
        told = "joined"
        try:
            if os.geteuid() == 0:
                os.setresuid(NOBODY, NOBODY, NOBODY)
            query_status(name)
        except BusError as error:
            told = str(error)
        finally:
            os.write(writer, told.encode())
            os._exit(0)
    os.close(writer)
    with os.fdopen(reader) as pipe:
        answer = pipe.read()
    os.waitpid(pid, 0)
    return answer


def test_another_user_may_not_join_and_is_reported_once(
    start_bus: Callable[..., Any],
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    own = os.geteuid()
    if own != 0:
        monkeypatch.setattr(os, "geteuid", lambda: NOBODY)
    bus = start_bus()
    for _ in range(2):
        assert "the user who runs it, and root" in join_as_nobody(bus.name)
    told = capsys.readouterr().err
    assert told.count("may not join") == 1
    assert f"user {own or NOBODY} may not join; allowed: the user who runs the bus" in told
    if own == 0:
        member = bus.join()
        member.send(0x123)
        assert member.quiet()
