"""Masses hung by a person: what is asked, what counts as an answer, and what no mass can be."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest

from cdpr_rt.clock import Clock, LockstepClock, PacedClock
from cdpr_rt.errors import RawLogError
from cdpr_rt.rawlog import RawLogWriter
from profiles import load_winch
from tests.cdpr_rt.operating_rig import Inertias, powered
from tools.errors import BadInputError
from tools.tension.calibration import recorded_winch
from tools.tension.masses import by_prompt, check_masses, have_hung, mass_points


@contextmanager
def ignored(number: int) -> Iterator[None]:
    before = signal.signal(number, signal.SIG_IGN)
    try:
        yield
    finally:
        assert signal.signal(number, before) == signal.SIG_IGN  # put back as it was


def test_only_enter_alone_raises_the_mass(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    outlet, inlet = os.pipe()
    os.write(inlet, b"no\nwait\n\nfor the next\n")
    os.close(inlet)
    with os.fdopen(outlet) as answers:
        monkeypatch.setattr("sys.stdin", answers)
        by_prompt(5.0, LockstepClock())
        assert answers.read() == "for the next\n"
        told = capsys.readouterr().err
        assert told.count("Hang 5 kg") == 3 and told.count("Enter alone") == 2
        with pytest.raises(BadInputError, match="nobody has hung 2 kg; the drive is without power"):
            by_prompt(2.0, LockstepClock())


def test_a_question_left_open_does_not_spoil_the_end_of_the_process() -> None:
    ask = "from cdpr_rt.clock import PacedClock as C; from tools.tension.masses import by_prompt"
    catch = "\ntry: by_prompt(5.0, C())\nexcept Exception as error: print(error)"
    with subprocess.Popen(
        [sys.executable, "-c", ask + catch],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    ) as process:
        assert process.stderr is not None and process.stdout is not None
        assert process.stderr.read(9) == "Hang 5 kg"
        process.send_signal(signal.SIGINT)
        assert "nobody has hung 5 kg" in process.stdout.read()
        assert process.wait(30) == 0


@pytest.mark.parametrize("clock", [LockstepClock, PacedClock])
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_ends_the_question(
    monkeypatch: pytest.MonkeyPatch, number: int, clock: Callable[[], Clock]
) -> None:
    outlet, inlet = os.pipe()
    too_late = threading.Timer(10.0, os.write, (inlet, b"\n"))
    sent = threading.Timer(0.1, os.kill, (os.getpid(), number))
    with os.fdopen(outlet) as answers, ignored(number):
        monkeypatch.setattr("sys.stdin", answers)
        too_late.start()
        sent.start()
        try:
            with pytest.raises(BadInputError, match="nobody has hung 5 kg"):
                by_prompt(5.0, clock())
        finally:  # a signal that comes later ends the test run
            sent.join()
            too_late.cancel()
    os.close(inlet)


def test_a_signal_ends_the_question_while_cycles_run(monkeypatch: pytest.MonkeyPatch) -> None:
    outlet, inlet = os.pipe()
    too_late = threading.Timer(10.0, os.write, (inlet, b"\n"))
    sent = threading.Timer(0.3, os.kill, (os.getpid(), signal.SIGINT))
    with os.fdopen(outlet) as answers, ignored(signal.SIGINT), powered(Inertias(False)) as rig:
        monkeypatch.setattr("sys.stdin", answers)
        rig.operator.disable()
        began = rig.device.feedback.cycle
        too_late.start()
        sent.start()
        try:
            with pytest.raises(BadInputError, match="nobody has hung 5 kg"):
                have_hung(rig.operator, 5.0, by_prompt)
        finally:
            sent.join()
            too_late.cancel()
        assert rig.device.feedback.cycle > began + 100
        assert not rig.loop.works_slowly
    os.close(inlet)


@pytest.mark.parametrize(
    "masses", [(2.0, 5.0), (2.0, 5.0, float("nan")), (2.0, 2.0, 5.0), (-1.0, 2.0, 5.0), (4, 5, 6)]
)
def test_masses_that_cannot_tell_the_gain_are_refused(masses: tuple[float, ...]) -> None:
    with pytest.raises(BadInputError, match="--masses: "):
        check_masses(load_winch("winch-mpp0923d"), masses, 9.81)


def test_a_recording_of_something_else_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "raw" / "mass-2kg.raw"
    log = RawLogWriter(path, ["time_s"], {"identity": {"winch": "w", "motor": "m", "serial": "x"}})
    log.write(np.zeros((3, 1)))
    log.close()
    with pytest.raises(RawLogError, match="not a recording of a hoist"):
        mass_points([path])
    with pytest.raises(RawLogError, match="does not say which winch"):
        recorded_winch(tmp_path)
