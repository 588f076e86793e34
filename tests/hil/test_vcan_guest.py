"""A vcan test passes only if it ran: outcomes of the guest are replayed faithfully."""

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
import vcan_guest
from vcan_guest import NoGuestError
from vcan_replay import Outcome, parse, replay


def _phase(item: pytest.Item, when: str, outcome: str, longrepr: object = None) -> str:
    return json.dumps(
        {
            "nodeid": item.nodeid,
            "location": list(item.location),
            "keywords": {},
            "outcome": outcome,
            "longrepr": longrepr,
            "when": when,
            "sections": [],
            "duration": 0.1,
            "start": 0.0,
            "stop": 0.1,
        }
    )


def _outcomes(item: pytest.Item, outcome: Outcome) -> list[str]:
    return [f"{r.when} {r.outcome}" for r in replay(item, outcome)]


def test_a_test_is_skipped_with_the_reason_if_there_is_no_guest(request: pytest.FixtureRequest):
    (report,) = replay(request.node, Outcome({}, "", "no apt-get"))
    assert report.outcome == "skipped"
    assert isinstance(report.longrepr, tuple)
    assert report.longrepr[2].endswith("no guest kernel: no apt-get")


def test_reports_of_the_guest_are_replayed(request: pytest.FixtureRequest):
    item = request.node
    ran = [_phase(item, when, "passed") for when in ("setup", "call", "teardown")]
    whole = Outcome(parse("".join(line + "\n" for line in ran)), "")
    assert _outcomes(item, whole) == ["setup passed", "call passed", "teardown passed"]
    ran[1] = _phase(item, "call", "failed", "assert 1 == 2")
    failed = Outcome(parse("".join(line + "\n" for line in ran)), "")
    assert _outcomes(item, failed) == ["setup passed", "call failed", "teardown passed"]
    ran[1] = _phase(item, "call", "skipped", ["f.py", 3, "Skipped: no"])
    skipped = Outcome(parse("".join(line + "\n" for line in ran)), "")
    assert [r.longrepr for r in replay(item, skipped)][1] == ("f.py", 3, "Skipped: no")


@pytest.mark.parametrize("lines", [0, 1, 2])
def test_a_guest_that_dies_fails_the_test(request: pytest.FixtureRequest, lines: int):
    item = request.node
    ran = [_phase(item, when, "passed") for when in ("setup", "call", "teardown")]
    cut = "".join(line + "\n" for line in ran[:lines]) + ran[lines][:-5]
    last = list(replay(item, Outcome(parse(cut), "Kernel panic")))[-1]
    assert last.outcome == "failed"
    assert "Kernel panic" in str(last.longrepr)


def test_a_machine_without_apt_is_reported(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(NoGuestError, match="no apt-get here to fetch user-mode-linux"):
        vcan_guest.obtain(tmp_path / "guest")


def test_a_kernel_that_does_not_start_is_reported(tmp_path: Path):
    (tmp_path / "run").mkdir()
    (tmp_path / "modules").mkdir()
    kernel = tmp_path / "linux.uml"
    kernel.write_text("#!/bin/sh\necho cannot map memory\n")
    kernel.chmod(0o755)
    guest = vcan_guest.Guest(kernel, tmp_path / "modules", kernel)
    with pytest.raises(NoGuestError, match="did not start: cannot map memory"):
        vcan_guest.run(guest, ["true"], tmp_path, {}, tmp_path / "run")


def test_a_guest_that_hangs_is_stopped(tmp_path: Path):
    (tmp_path / "run").mkdir()
    (tmp_path / "run" / "ready").touch()  # as the guest does
    (tmp_path / "modules").mkdir()
    kernel = tmp_path / "linux.uml"
    kernel.write_text("#!/bin/sh\nsleep 60\n")
    kernel.chmod(0o755)
    guest = vcan_guest.Guest(kernel, tmp_path / "modules", kernel)
    run = vcan_guest.run(guest, ["true"], tmp_path, {}, tmp_path / "run", timeout_s=0.3)
    assert run.exit_code is None
    assert "stopped after 0 s" in run.output


_KERNEL = """
#include <errno.h>
#include <stdarg.h>
#include <string.h>
#include <sys/uio.h>

/* stands for Linux on a processor with an area of 11008 bytes, all of them 0xff */
unsigned char area[11008];

long ptrace(int request, ...)
{
    va_list arguments;
    va_start(arguments, request);
    (void)va_arg(arguments, int);
    (void)va_arg(arguments, void *);
    struct iovec *given = va_arg(arguments, struct iovec *);
    va_end(arguments);
    if (request == 0x4204) {
        memset(given->iov_base, 0xff, sizeof area);
        given->iov_len = sizeof area;
        return 0;
    }
    if (given->iov_len != sizeof area) {
        errno = EFAULT;
        return -1;
    }
    memcpy(area, given->iov_base, sizeof area);
    return 0;
}
"""
_TRACER = """
import ctypes
class IoVec(ctypes.Structure):
    _fields_ = [("base", ctypes.c_void_p), ("size", ctypes.c_size_t)]
registers = ctypes.create_string_buffer(b"\\x07" * 2696, 2696)
given = IoVec(ctypes.addressof(registers), 2696)
linux = ctypes.CDLL(None)
assert linux.ptrace(0x4205, 1, ctypes.c_void_p(0x202), ctypes.byref(given)) == 0
area = bytes((ctypes.c_ubyte * 11008).in_dll(linux, "area"))
assert area[:514] == b"\\x07" * 514 and area[514] == 0x01 and area[515:2696] == b"\\x07" * 2181
assert area[2696:] == b"\\xff" * (11008 - 2696)
"""


@pytest.mark.skipif(shutil.which("cc") is None, reason="no C compiler here")
def test_the_registers_of_a_guest_fit_into_the_area_of_a_processor_with_amx(tmp_path: Path):
    (tmp_path / "kernel.c").write_text(_KERNEL)
    made = ["cc", "-shared", "-fPIC", "-o", "kernel.so", "kernel.c"]
    subprocess.run(made, cwd=tmp_path, check=True, timeout=60)
    both = f"{vcan_guest.whole_xstate(tmp_path)}:{tmp_path}/kernel.so"
    tracer = [sys.executable, "-c", _TRACER]
    subprocess.run(tracer, env={**os.environ, "LD_PRELOAD": both}, check=True, timeout=60)
