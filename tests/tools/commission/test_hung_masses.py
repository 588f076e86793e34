"""A person hangs masses: the question, its answer, and signals."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

import pytest

from cdpr_rt.core.clock import Clock, LockstepClock, PacedClock
from cdpr_rt.errors import InvalidRequestError
from cdpr_tools.commission import tension_watch as watch
from cdpr_tools.commission.tension_calibration import have_hung
from cdpr_tools.commission.tension_watch import by_prompt
from tests.cdpr_rt.loop.operating_rig import Inertias, powered

LONGEST_S = 60.0


@contextmanager
def ignored(number: int) -> Iterator[None]:
    before = signal.signal(number, signal.SIG_IGN)
    try:
        yield
    finally:
        assert signal.signal(number, before) == signal.SIG_IGN  # the handler was restored


def test_only_an_empty_line_confirms_the_mass(
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
        assert told.count("Hang 5 kg") == 3 and told.count("Press only Enter") == 2
        with pytest.raises(InvalidRequestError, match="2 kg were not hung; the drive has no power"):
            by_prompt(2.0, LockstepClock())


def test_an_open_question_does_not_disturb_the_end_of_the_process() -> None:
    ask = (
        "from cdpr_rt.core.clock import PacedClock as C\n"
        "from cdpr_tools.commission.tension_watch import by_prompt"
    )
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
        assert "5 kg were not hung" in process.stdout.read()
        assert process.wait(60) == 0


@pytest.mark.parametrize("clock", [LockstepClock, PacedClock])
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_ends_the_question(
    monkeypatch: pytest.MonkeyPatch, number: int, clock: Callable[[], Clock]
) -> None:
    outlet, inlet = os.pipe()
    asked, typed = threading.Event(), watch.typed_line

    def ask(question: str, stop_requested: Callable[[], bool]) -> str:
        asked.set()
        return typed(question, stop_requested)

    def interrupt() -> None:
        asked.wait(LONGEST_S)
        os.kill(os.getpid(), number)

    too_late = threading.Timer(LONGEST_S, os.write, (inlet, b"\n"))
    sent = threading.Thread(target=interrupt)
    with os.fdopen(outlet) as answers, ignored(number):
        monkeypatch.setattr("sys.stdin", answers)
        monkeypatch.setattr(watch, "typed_line", ask)
        too_late.start()
        sent.start()
        try:
            with pytest.raises(InvalidRequestError, match="5 kg were not hung"):
                by_prompt(5.0, clock())
        finally:  # a later signal would end the test run
            sent.join()
            too_late.cancel()
    os.close(inlet)


def test_a_signal_together_with_enter_ends_the_question(monkeypatch: pytest.MonkeyPatch) -> None:
    def typed(_question: str, _stop_requested: Callable[[], bool]) -> str:
        signal.raise_signal(signal.SIGINT)
        return "\n"

    monkeypatch.setattr(watch, "typed_line", typed)
    with pytest.raises(InvalidRequestError, match="5 kg were not hung"):
        by_prompt(5.0, LockstepClock())


def test_a_signal_ends_the_question_while_cycles_run(monkeypatch: pytest.MonkeyPatch) -> None:
    outlet, inlet = os.pipe()
    too_late = threading.Timer(LONGEST_S, os.write, (inlet, b"\n"))
    with os.fdopen(outlet) as answers, ignored(signal.SIGINT), powered(Inertias(False)) as rig:
        monkeypatch.setattr("sys.stdin", answers)
        rig.operator.disable()
        began = rig.device.feedback.cycle

        def interrupt() -> None:
            while rig.device.feedback.cycle <= began + 100 and too_late.is_alive():
                time.sleep(0.01)
            os.kill(os.getpid(), signal.SIGINT)

        sent = threading.Thread(target=interrupt)
        too_late.start()
        sent.start()
        try:
            with pytest.raises(InvalidRequestError, match="5 kg were not hung"):
                have_hung(rig.operator, 5.0, by_prompt)
        finally:
            sent.join()
            too_late.cancel()
        assert rig.device.feedback.cycle > began + 100
        assert not rig.loop.runner.task_running
    os.close(inlet)
