"""What takes the loop more than a cycle: booting, checking, enabling, stopping.

Each is a generator that the loop advances once a turn, after the cycle's command has been sent. It
may be dropped at any `yield`; whatever drops it says how things go on. Where it cannot be done it
raises ControlError, which goes to whoever asked.
"""

from __future__ import annotations

import gc
from collections.abc import Callable, Iterator, Mapping
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from cdpr_rt.errors import ControlError
from cdpr_rt.runtime.lifecycle import RefusedError
from cdpr_rt.runtime.states import LoopState, Reaction

if TYPE_CHECKING:
    from cdpr_rt.runtime.loop import ControlLoop

CHECK_S: Final = 0.25
"""For how long cycles are looked at before the bus counts as good."""
_CHECK_CYCLES: Final = 20
_SETTLE_CYCLES: Final = 5
_LOOKS: Final = 4
_MODE_S: Final = 2.0
_POWER_ON_S: Final = 4.0
_SETTLE_S: Final = 1.0
_STILL_RAD_S: Final = 0.3
_BRAKES_S: Final = 2.0
_POWER_OFF_S: Final = 3.0
_POWER_OFF_AT_LAST_S: Final = 0.5
_FAULT_RESET_S: Final = 2.0
_BEFORE: Final = " (before: "


def start_up(loop: ControlLoop) -> Iterator[None]:
    """Boot and check; the reason stays where either fails."""
    try:
        yield from configure(loop)
        yield from check(loop)
    except ControlError as error:
        loop.life.blame(str(error))


def configure(loop: ControlLoop) -> Iterator[None]:
    """Boot the drives; inactive then, unconfigured where it fails."""
    life, machine = loop.life, loop.machine
    loop.stop_cycles()
    if machine.device is not None:
        yield from _slowly(loop, machine.close)
    life.enter(LoopState.UNCONFIGURED)
    life.forget()
    try:
        yield from _slowly(loop, machine.open)
    except ControlError as error:
        life.blame(str(error))
        raise
    life.enter(LoopState.INACTIVE)


def check(loop: ControlLoop, reset: bool = False) -> Iterator[None]:
    """Run cycles without power and look at every answer; ready then, inactive where it fails.

    Drives in fault fail it, unless somebody has asked for their `reset`.
    """
    life, machine = loop.life, loop.machine
    if loop.cycling:
        loop.stop_cycles()
        yield from _slowly(loop, machine.pause)
    life.enter(LoopState.INACTIVE)
    life.forget()
    try:
        yield from _slowly(loop, machine.prepare)
        gc.collect()  # while nothing is late by it; in paced cycles the collector is off
        loop.start_cycles()
        if reset:
            yield from _reset_faults(loop)
        yield from _look_at_cycles(loop)
    except ControlError as error:
        life.blame(str(error))
        yield from _explain(loop)
        loop.stop_cycles()
        yield from _leave_cycles(loop)
        raise RefusedError(life.reason) from error
    life.enter(LoopState.READY)
    if machine.read_only:
        loop.switch("hold")


def _reset_faults(loop: ControlLoop) -> Iterator[None]:
    machine = loop.machine
    for _ in range(_SETTLE_CYCLES):  # in which each drive tells its state
        yield
    if not machine.intact():
        return  # what needs a new boot is not to be forgotten
    machine.reset_faults()
    yield
    try:
        yield from _until(loop, machine.faultless, _FAULT_RESET_S, "the reset of all faults")
    except RefusedError as error:
        raise RefusedError(f"{error}: {', '.join(machine.states())}") from error


def _look_at_cycles(loop: ControlLoop) -> Iterator[None]:
    machine, cycle = loop.machine, loop.cycle
    assert cycle is not None  # cycles run
    device = cycle.device
    for _ in _up_to(loop, _MODE_S, machine.prepared):
        _refuse_trouble(loop)
        yield
    if not machine.prepared():
        raise RefusedError(machine.unprepared())
    cycles = max(_CHECK_CYCLES, round(CHECK_S / device.period_s))
    limits = loop.parts.supervisor.limits
    allowed = cycles * device.n * limits.missed_in_window / limits.window_cycles
    missed = 0
    # a machine that was held up just now may look once more; a bus that is bad stays so
    for _ in range(_LOOKS):
        yield from _look_once(loop, cycles)
        missed = loop.status.check["missed"]
        if missed <= max(1.0, allowed):
            return
    raise RefusedError(
        f"check: {missed} of {cycles * device.n} answers did not come in time, looked at "
        f"{_LOOKS} times; see `cdpr bus monitor`"
    )


def _look_once(loop: ControlLoop, cycles: int) -> Iterator[None]:
    """Look at so many cycles, and keep what was seen for the status."""
    machine, cycle = loop.machine, loop.cycle
    assert cycle is not None  # cycles run
    for _ in range(_SETTLE_CYCLES):
        yield
    missed, late, slowest_s = loop.missed, cycle.lateness.late, 0.0
    for _ in range(cycles):
        yield
        _refuse_trouble(loop)
        if not machine.unpowered() and not machine.read_only:
            raise RefusedError(f"check: a drive has power: {', '.join(machine.states())}")
        slowest_s = max(slowest_s, loop.exchange_s)
    loop.status.check = {
        "cycles": cycles,
        "missed": loop.missed - missed,
        "late": cycle.lateness.late - late,
        "slowest_exchange_s": slowest_s,
    }


def _refuse_trouble(loop: ControlLoop) -> None:
    assert loop.cycle is not None  # cycles run
    trouble = loop.lost_bus or loop.cycle.device_alarm() or loop.cycle.watch_alarm()
    trouble = trouble or loop.cycle.stop_reason()
    if trouble:
        raise RefusedError(trouble)


def between_cycles(loop: ControlLoop, work: Callable[[], Any]) -> Iterator[None]:
    """Run `work`, which may wait, while no cycles run; refused where the drives have power."""
    if loop.life.state is not LoopState.READY:
        raise RefusedError(f"cycles do not stop in state {loop.life.state.label}")
    loop.stop_cycles()
    yield from _slowly(loop, loop.machine.pause)
    job = loop.job(work)
    while not job.done:
        yield
    loop.start_cycles()
    job.result()


def enable(
    loop: ControlLoop, program: str, wanted: Mapping[str, Any] | None, right: int
) -> Iterator[None]:
    """Give the drives power, hold, release the brakes, then run `program`.

    The drives go on to hold where the taking number `right` does not hold any more by then.
    """
    life, machine = loop.life, loop.machine
    loop.parts.programs[program].check(wanted or {})
    loop.first_program = program
    life.forget()
    machine.power_on()
    life.enter(LoopState.ACTIVE)
    waits = _until(loop, machine.powered, _POWER_ON_S, "the power of all drives")
    try:
        yield from waits
    except ControlError as error:
        life.blame(f"{error}: {', '.join(machine.states())}")
        loop.stop(Reaction.TORQUE_OFF, LoopState.FAULT)
        raise ControlError(life.reason) from error
    last, device = loop.parts.last, machine.device
    if last is not None and device is not None:
        position_rad = device.feedback.position_rad.copy()
        yield from _aside(loop, lambda: last.begin_to_move(position_rad))
    loop.drive()
    machine.set_brakes(True)
    while not machine.brakes_are(True):
        yield
    if loop.first_program == "hold":
        return
    missing = loop.right.missing(right)
    if missing:
        life.blame(f"{program}: {missing}; held")
        raise RefusedError(life.reason)
    loop.switch(program, wanted or {}, right)


def come_to_rest(loop: ControlLoop, then: LoopState) -> Iterator[None]:
    """See to the end of a motion that has been ended, until the drives have no power."""
    life, machine, led = loop.life, loop.machine, loop.driving
    if led:
        yield from _brake(loop)
    else:
        machine.set_brakes(False)
    yield from _up_to(loop, _POWER_OFF_S, machine.unpowered)
    machine.power_off()
    yield  # one command at least, so that it is sent
    yield from _up_to(loop, _POWER_OFF_AT_LAST_S, machine.unpowered)
    doubts: list[str] = []
    yield from _slowly(loop, lambda: doubts.append(machine.make_sure()))
    if led or machine.has_brakes:  # what fell when its power went is not where it was seen last
        yield from _keep_lengths(loop)
    if any(doubts):
        life.blame("; ".join(filter(None, (life.reason, *doubts))), life.details)
        then = LoopState.FAULT
    life.enter(then)
    loop.reacting = Reaction.NONE
    if then is LoopState.FAULT:
        yield from _explain(loop)


def _brake(loop: ControlLoop) -> Iterator[None]:
    """Wait until the axes stand under their program, have the brakes hold them, take the power.

    A platform that no brakes would hold is let down first.
    """
    machine, velocity = loop.machine, loop.parts.estimator.estimate.velocity_rad_s
    if loop.program.name != "lower":
        yield from _up_to(loop, loop.program.rest_s, lambda: loop.program.at_rest)
        loop.switch("lower" if loop.lowers else "hold")
    if loop.lowers:
        yield from _up_to(loop, loop.parts.lowering_s, lambda: loop.program.at_rest)
    else:
        yield from _up_to(loop, _SETTLE_S, lambda: bool(np.max(np.abs(velocity)) < _STILL_RAD_S))
    machine.set_brakes(False)
    yield from _up_to(loop, _BRAKES_S, lambda: machine.brakes_are(False))
    machine.power_off()
    loop.driving = False
    loop.switch("idle")


def _keep_lengths(loop: ControlLoop) -> Iterator[None]:
    """Keep the cables' lengths for the next start, where they are known."""
    last, device = loop.parts.last, loop.machine.device
    if last is None or device is None:
        return
    try:
        yield from _aside(loop, lambda: last.keep(loop.parts.estimator.estimate, device.feedback))
    except ControlError as error:
        loop.notices.append(str(error))


def fall(loop: ControlLoop) -> Iterator[None]:
    """Go to fault from a state without power."""
    loop.life.enter(LoopState.FAULT)
    loop.driving = False
    loop.machine.set_brakes(False)
    yield
    loop.reacting = Reaction.NONE
    yield from _explain(loop)


def _explain(loop: ControlLoop) -> Iterator[None]:
    """Ask drives and guards what they say of the reason, and leave a bus that has gone."""
    life, machine = loop.life, loop.machine
    found: list[str] = []
    yield from _slowly(loop, lambda: found.append(machine.explain(life.reason)))
    if found:
        life.blame(found[0], life.details)
    if loop.lost_bus:
        loop.stop_cycles()
        yield from _leave_cycles(loop)


def disable(loop: ControlLoop) -> Iterator[None]:
    """Stop under control and take the power away."""
    if loop.life.state is LoopState.ACTIVE:
        loop.reacting = Reaction.CONTROLLED_STOP
        if loop.driving:
            loop.program.stop()
        else:
            loop.machine.power_off()
        yield from come_to_rest(loop, LoopState.READY)


def acknowledge(loop: ControlLoop) -> Iterator[None]:
    """Clear what was latched, boot anew where that is needed, and check."""
    life, machine = loop.life, loop.machine
    now, _, before = life.reason.partition(_BEFORE)
    before = before.removesuffix(")") or now
    try:
        if machine.device is not None:
            yield from _slowly(loop, machine.acknowledge)
        intact = loop.cycling and machine.intact()
        if intact:
            yield from _reset_faults(loop)
        else:
            yield from configure(loop)
        yield from check(loop, reset=not intact)
    except ControlError as error:
        life.enter(LoopState.FAULT)
        life.blame(f"{error}{_BEFORE}{before})" if before not in str(error) else str(error))
        raise


def shut_down(loop: ControlLoop) -> Iterator[None]:
    """Stop under control, leave the drives without power, and end the loop."""
    if loop.life.state is LoopState.ACTIVE:
        if loop.reacting is Reaction.NONE:
            yield from disable(loop)
        else:
            yield from come_to_rest(loop, LoopState.READY)
    loop.stop_cycles()
    doubt: list[str] = []
    try:
        yield from _slowly(loop, lambda: doubt.append(loop.machine.close()))
    except ControlError as error:  # such as a contactor that stays closed
        doubt.append(str(error))
    if any(doubt):
        loop.doubt = doubt[0]
        loop.life.blame(loop.doubt)
    loop.life.enter(LoopState.UNCONFIGURED)
    loop.ended = True


def _up_to(loop: ControlLoop, within_s: float, done: Callable[[], bool]) -> Iterator[None]:
    for _ in range(loop.cycles_in(within_s)):
        if done():
            return
        yield


def _until(
    loop: ControlLoop, done: Callable[[], bool], within_s: float, what: str
) -> Iterator[None]:
    for _ in range(loop.cycles_in(within_s)):
        if done():
            return
        yield
    raise RefusedError(f"{what}: not within {within_s:g} s")


def _leave_cycles(loop: ControlLoop) -> Iterator[None]:
    """Have the drives left alone for a while; a bus that is gone is no error here."""
    try:
        yield from _slowly(loop, loop.machine.pause)
    except ControlError:
        return


def _slowly(loop: ControlLoop, work: Callable[[], Any]) -> Iterator[None]:
    """Run `work`, which may wait, as a task beside the cycle; raises what it raises."""
    job = loop.job(work)
    while not job.done:
        yield
    job.result()


def _aside(loop: ControlLoop, work: Callable[[], Any]) -> Iterator[None]:
    """Run `work`, which touches no bus, where it keeps no cycle waiting; raises what it raises."""
    yield from _slowly(loop, lambda: loop.machine.clock.aside(work))
