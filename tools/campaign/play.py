"""Play a scenario on a simulated robot, and keep what a judge needs."""

from __future__ import annotations

import hashlib
import os
import random
import re
import resource
import traceback
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

import numpy as np

from cdpr_rt.arrays import IntArray
from cdpr_rt.core.cycle_row import FIELDS, WALL_TIMES
from cdpr_rt.robot import Error
from cdpr_rt.service.lease import LeaseError
from cdpr_rt.service.recording import Recorder
from cdpr_tools.campaign.scenario import BEFORE_BOOT, READY, TIGHT, Action, Scenario
from cdpr_tools.client.status_text import next_steps
from cdpr_tools.lockstep_robot import LockstepRobot
from cdpr_tools.recordings.truth import NO_SYNC, read_pose_log

_TIGHTEN_S: Final = 120.0
_SETTLE_S: Final = 30.0
_AFTER_S: Final = 0.3
_DEAD_S: Final = 3.2
_REPLY_S: Final = 60.0
_LOOK_CYCLES: Final = 5
_STREAM_Hz: Final = 50.0
_RING_S: Final = 60.0
_RECORDING: Final = "recording"
_MOST_ROUNDS: Final = 4
_LEASE_S: Final = 2.5
BY_HAND: Final = "take up slack by hand"
"""A remedy that the status gives, and that no command can carry out."""


@dataclass
class Played:
    """What happened: everything that judges look at."""

    scenario: Scenario
    began_s: float = 0.0
    """Bus time at which the scenario began; all times are bus times of the simulator."""
    replies: list[dict[str, Any]] = field(default_factory=list)
    """Commands: `do`, `number`, `at_s`, and their `ok`, `text`; None while there is no reply."""
    done: list[tuple[str, float]] = field(default_factory=list)
    """Names of the actions, and when they began."""
    statuses: list[dict[str, Any]] = field(default_factory=list)
    """The loop's status whenever it changed, with `at_s`."""
    dead_s: float | None = None
    """Bus time at which the loop was killed."""
    settled_s: float | None = None
    """Bus time at which everything had come to rest; None if that did not happen."""
    recovery: list[str] = field(default_factory=list)
    """Steps that were taken to work again, and the reason why one failed."""
    recovered: bool | None = None
    """Whether the robot works again; None if that was not tried, or needs work by hand."""
    truth: Any = None
    """Records of the pose log since the beginning."""
    rows: Any = None
    """The last rows, as many as the ring keeps."""
    cycles: int = 0
    """Number of rows since the beginning."""
    row_truth: Any = None
    """Number of the record of the truth at each row, or -1."""
    last_truth: dict[str, Any] = field(default_factory=dict)
    rise_MB: float = 0.0
    output: str = ""
    """What the loop printed."""
    digest: str = ""
    recordings: list[Path] = field(default_factory=list)


class RobotAtStart:
    """A robot in the state in which scenarios begin; a context manager, see `LockstepRobot`."""

    def __init__(self, scenario: Scenario, folder: Path, record: Path | None = None) -> None:
        plant = folder / "plant.toml"
        plant.write_text(scenario.plant_text(), encoding="utf-8")
        self.rig = LockstepRobot(
            scenario.robot, plant=plant, ring_s=_RING_S, boots=False, record=record
        )

    def advance(self, start: str) -> None:
        """Bring the robot from the start before to this one; raises Error."""
        if start == READY:
            self.rig.boot()
        elif start == TIGHT:
            self.rig.enable()
            self.rig.program("tighten")
            self.rig.finish(_TIGHTEN_S)
            progress = self.rig.progress
            if not progress["tight"]:  # friction may hold a tight platform off its target
                raise Error(f"tighten: {progress.get('trouble')}")


STARTS: Final = (BEFORE_BOOT, READY, TIGHT)


class Player:
    """Plays one scenario on a robot that is at its start."""

    def __init__(self, scenario: Scenario, start: RobotAtStart) -> None:
        self._scenario, self._rig, self._simulator = scenario, start.rig, start.rig.simulator
        self.played = Played(scenario, self._now_s)
        self._first_row = self._rig.rows_written
        self._first_truth = self._truth_size()
        self._waiting: dict[int, dict[str, Any]] = {}
        self._seen = -1
        self._random = random.Random(f"stream {scenario.seed}")
        self._plans = 0
        self._syncs: list[tuple[int, int]] = []
        """Number of rows and of SYNCs after each group of cycles."""

    def play(self) -> Played:
        """Carry out all actions and faults; return what happened."""
        played, rig = self.played, self._rig
        memory_MB = _memory_MB()
        if self._scenario.recorded:
            self._begin_recording()
        for fault in self._scenario.faults:
            self._simulator.inject(**fault | {"at_s": played.began_s + fault["at_s"]})
        if self._scenario.start == BEFORE_BOOT:
            rig.right.take("campaign")
            rig.loop.runner.begin(rig.loop.transitions.start_up())
        for action in self._scenario.actions:
            self._do(action)
            if played.dead_s is not None:
                break
            self._run(action["wait_s"])
        if played.dead_s is None:
            last_s = max([played.began_s, *(f["at_s"] + played.began_s
                                            for f in self._scenario.faults)])  # fmt: skip
            self._run(max(0.0, last_s - self._now_s) + _AFTER_S)
            self._settle()
            if self._scenario.recovers and played.settled_s is not None:
                self._recover()
        self._look()
        played.rise_MB = _memory_MB() - memory_MB  # without the copies for the judge
        self._finish()
        return played

    def _begin_recording(self) -> None:
        rig = self._rig
        rig.block.counters["recorded"][0] = rig.rows_written
        folder = rig.folder / _RECORDING
        folder.mkdir()
        rig.recorder = Recorder(rig.block, folder, rig.robot.profile)
        rig.recorder.begin()

    # -- time

    @property
    def _now_s(self) -> float:
        return self._rig.machine.clock.now_s

    def _run(self, seconds: float) -> None:
        """Run cycles, and note what changes."""
        end_s = self._now_s + seconds - 0.5 * self._rig.period_s
        while self._now_s < end_s:
            self._rig.turn(_LOOK_CYCLES)
            self._syncs.append((self._rig.rows_written, self._simulator.sync_count))
            self._look()

    def _run_until(self, done: Callable[[], bool], within_s: float) -> bool:
        end_s = self._now_s + within_s
        while not done():
            if self._now_s > end_s:
                return False
            self._run(0.02)
        return True

    def _look(self) -> None:
        """Note replies, and the status if it has changed."""
        block = self._rig.block
        while (answer := block.take_reply()) is not None:
            if (command := self._waiting.pop(answer["to"], None)) is not None:
                command |= {"ok": answer["ok"], "text": answer["text"], "replied_s": self._now_s}
        version = int(block.counters["status"][0])
        if version != self._seen:
            self._seen = version
            self.played.statuses.append(_kept(block.status()) | {"at_s": self._now_s})

    def _settle(self) -> None:
        """Wait until a reaction or a command has ended."""
        loop, played = self._rig.loop, self.played
        lowering = loop.engine.parts.lowering
        longest_s = 0.0 if lowering is None else lowering.longest_s

        def settled() -> bool:
            return not loop.busy and not loop.engine.reacting and not self._waiting

        if self._run_until(settled, _SETTLE_S + longest_s):
            played.settled_s = self._now_s
            self._run(_AFTER_S)

    # -- actions

    def _do(self, action: Action) -> None:
        name = action["do"].replace(" ", "_")
        self.played.done.append((action["do"], self._now_s))
        own = getattr(self, f"_do_{name}", None)
        if own is not None:
            own(action)
        elif name == "wait":
            return
        elif name == "move":
            wanted = {key: value for key, value in action.items() if key not in ("do", "wait_s")}
            self._program("pose", wanted)
        elif name in ("lower", "tighten"):
            self._program(name, {key: action[key] for key in ("from", "blind") if key in action})
        else:
            self._post({"do": name})

    def _post(self, command: dict[str, Any], *, urgent: bool = False) -> dict[str, Any]:
        """Send a command as the service does; its reply is noted when it comes."""
        rig = self._rig
        given = {"client": "campaign", "right": rig.right.number, **command}
        number = rig.block.post_urgent(given) if urgent else rig.block.post_command(given)
        noted = {"do": command.get("program") or command["do"], "number": number,
                 "at_s": self._now_s, "ok": None, "text": None}  # fmt: skip
        self.played.replies.append(noted)
        self._waiting[number] = noted
        return noted

    def _program(self, name: str, wanted: dict[str, Any]) -> dict[str, Any]:
        return self._post({"do": "program", "program": name, "wanted": wanted})

    def _do_resume(self, _: Action) -> None:
        follows = bool((self._rig.brief_status()["program_progress"] or {}).get("path"))
        self._program("path" if follows else "pose", {"resume": True})

    def _do_jog(self, action: Action) -> None:
        wanted = {key: action[key] for key in ("velocity_rad_s", "duration_s")}
        self._program("jog", wanted | {"timeout_s": 0.6})

    def _do_stop(self, _: Action) -> None:
        self._rig.block.count_stop()
        self._post({"do": "disable"}, urgent=True)

    def _do_power_off(self, _: Action) -> None:
        self._rig.loop.request_power_off()

    def _do_leave(self, _: Action) -> None:
        self._rig.right.fall_silent()

    def _do_return(self, _: Action) -> None:
        try:
            self._rig.right.take("campaign")
        except LeaseError as error:
            assert str(error)

    def _do_stall(self, action: Action) -> None:
        """Stop the loop's process for a while; bus time continues."""
        self._rig.machine.clock.sleep(action["seconds"])

    def _do_die(self, _: Action) -> None:
        self.played.dead_s = self._now_s
        self._rig.die(_DEAD_S)

    def _do_path(self, action: Action) -> None:
        self._plans += 1
        file = self._rig.folder / f"path-{self._plans}.toml"
        points = [f"[[points]]\nposition_m = {point}\n" for point in action["points_m"]]
        file.write_text("".join(points), encoding="utf-8")
        noted = {"do": "path", "number": 0, "at_s": self._now_s, "ok": True, "text": ""}
        try:
            plan = self._rig.plan(file)
        except Error as error:
            text = str(error).replace(f"{file.parent}/", "")
            self.played.replies.append(noted | {"ok": False, "text": text})
            return
        self._program("path", {"plan": plan})

    def _do_stream(self, action: Action) -> None:
        """Lead the platform to a place and back by set-points, with some lost."""
        rig = self._rig
        try:
            sender = rig.stream.sender()
        except LeaseError as error:
            assert str(error)
            return
        self._program("pose", {"stream": True})
        steps = max(1, round(action["seconds"] * _STREAM_Hz))
        to = np.zeros(3)
        to[: len(action["to_m"])] = action["to_m"]
        for step in range(steps):
            share = 0.1 * np.sin(np.pi * step / steps)
            packet = sender.packet(self._now_s, (share * to).tolist())
            if self._random.random() >= action["loss"]:
                rig.stream.take(packet)
            self._run(1.0 / _STREAM_Hz)

    # -- afterwards

    def _recover(self) -> None:
        """Repair everything and follow the steps that the status gives."""
        played, rig = self.played, self._rig
        self._inject("mend")
        if rig.right.token is None:
            self._run(_LEASE_S)  # until the right of the client that has left expires
            rig.right.take("campaign")
        self._run(0.1)
        engine = rig.loop.engine
        # a stream never comes to rest
        self._run_until(
            lambda: not engine.driving or engine.program.at_rest or engine.program.name == "pose",
            _TIGHTEN_S,
        )
        played.recovered = False
        # the hand that has pushed a loose platform from its stand also carries it back
        pushed = any(fault["fault"].startswith("push") for fault in self._scenario.faults)
        for _ in range(_MOST_ROUNDS):
            status = rig.status() | {"robot": rig.robot.profile}
            steps = " ".join(map(str.strip, next_steps(status)))
            if not steps:
                break
            played.recovery.append(steps)
            if (status["last_stop"] or {}).get("fallen") or (pushed and not status["driving"]):
                self._inject("put-back")
                self._run(0.1)
            for step in re.findall(r"`cdpr (check|ack|enable|tighten --from home|tighten)`", steps):
                if not all(self._succeeds(command) for command in _COMMANDS[step]):
                    return
        move = {"do": "program", "program": "pose", "wanted": self._lowest_place()}
        played.recovered = self._succeeds(move)

    def _inject(self, fault: str) -> None:
        self.played.done.append((fault, self._now_s))
        self._simulator.inject(fault)

    def _lowest_place(self) -> dict[str, Any]:
        """Return a target in the middle of the workspace, near its lower end."""
        platform = self._rig.robot.platform
        assert platform is not None
        low, high = np.array(platform.workspace_min_m), np.array(platform.workspace_max_m)
        place = 0.5 * (low + high)
        place[-1] = low[-1] + 0.02
        return {"position_m": place.round(4).tolist()}

    def _succeeds(self, command: dict[str, Any]) -> bool:
        rig, played = self._rig, self.played
        noted = self._post(command)
        name = str(noted["do"])
        if not self._run_until(lambda: noted["ok"] is not None, _REPLY_S) or not noted["ok"]:
            played.recovery.append(f"{name}: {noted['text'] or 'no reply'}")
            return False
        if command["do"] != "program":
            return True
        program = rig.loop.engine.program
        self._run_until(
            lambda: rig.loop.engine.program is not program or program.at_rest, _TIGHTEN_S
        )
        progress = program.progress()
        trouble = "" if rig.loop.engine.program is program else rig.state_text()
        if not progress.get("tight"):  # friction may hold a tight platform off its target
            trouble = trouble or str(progress.get("trouble") or "")
        trouble = trouble or ("" if program.at_rest else "not done in time")
        if trouble:
            played.recovery.append(f"{name}: {trouble}")
        if BY_HAND in trouble:
            played.recovered = None
        return not trouble

    def _truth_size(self) -> int:
        return len(read_pose_log(self._simulator.truth_log, without_sync=True))

    def _finish(self) -> None:
        played, rig = self.played, self._rig
        played.last_truth = self._simulator.truth()
        played.truth = read_pose_log(self._simulator.truth_log, without_sync=True)[
            self._first_truth :
        ]
        rows = rig.kept_rows(self._first_row)
        played.cycles = rig.rows_written - self._first_row
        played.rows, played.row_truth = rows, self._row_truth(rows.size)
        digest = hashlib.sha256(played.truth.tobytes())
        for name in FIELDS:
            if name not in WALL_TIMES:
                digest.update(np.ascontiguousarray(rows[name]).tobytes())
        digest.update(repr(played.replies).encode())
        digest.update(repr(played.recovery).encode())
        played.digest = digest.hexdigest()[:16]
        if self._scenario.recorded and rig.recorder is not None:
            rig.recorder.finish()
            played.recordings = sorted((rig.folder / _RECORDING).glob("*.mcap"))

    def _row_truth(self, kept: int) -> IntArray:
        """Return the number of the record of the truth at each of the last rows, -1 for none.

        The loop counts its cycles from its start, the log has more records than SYNCs in a stall,
        and fewer SYNCs than cycles while the first drive is off.
        """
        sync_index = self.played.truth["sync_index"]
        records = np.flatnonzero(sync_index != NO_SYNC)
        row = self._rig.rows_written - kept + np.arange(kept)
        written, syncs = np.array([*self._syncs, (np.inf, 0)]).T
        group = np.searchsorted(written, row, side="right")
        sync = syncs[group] - (written[group] - row)
        at = np.searchsorted(sync_index[records], sync)
        found = at < records.size
        found[found] = sync_index[records[at[found]]] == sync[found]
        found &= sync > np.r_[-np.inf, syncs[:-1]][group]
        return np.where(found, records[np.where(found, at, 0)], -1)


_TIGHTEN: Final = {"do": "program", "program": "tighten"}
_COMMANDS: Final[dict[str, list[dict[str, Any]]]] = {
    "check": [{"do": "configure"}, {"do": "check"}],
    "ack": [{"do": "acknowledge"}],
    "enable": [{"do": "enable"}],
    "tighten": [_TIGHTEN],
    "tighten --from home": [_TIGHTEN | {"wanted": {"from": "home"}}],
}
"""Commands to the loop for each next step that the status names."""
_STATUS_KEYS: Final = (
    "state", "reason", "reason_limit", "faults", "program", "driving", "reacting", "busy",
    "last_stop", "notices", "failure", "count", "program_progress",
)  # fmt: skip


def _kept(status: dict[str, Any]) -> dict[str, Any]:
    return {key: status.get(key) for key in _STATUS_KEYS}


def _memory_MB() -> float:
    """Return the largest resident memory of this process so far."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0


@contextmanager
def output_to(file: Path) -> Iterator[None]:
    """Write what this process prints, and the traceback of an exception, into a file."""
    kept = [os.dup(1), os.dup(2)]
    with file.open("ab") as out:
        for number in (1, 2):
            os.dup2(out.fileno(), number)
    try:
        yield
    except Exception:
        os.write(2, traceback.format_exc().encode())
        raise
    finally:
        for number, old in enumerate(kept, 1):
            os.dup2(old, number)
            os.close(old)
