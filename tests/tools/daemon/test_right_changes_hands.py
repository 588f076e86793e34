"""During a thousand grants of the right to move, no cycle moves under an expired right.

Two clients move axis 0, one forwards and one backwards, so that each set-point shows its sender.
An attacker tries to move axis 1. Everything passes through the lease, the session manager of the
set-point stream, and shared memory to the loop and its simulated drives. The test only controls
the time.
"""

from __future__ import annotations

import random
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pytest

from cdpr_rt.core.states import LoopState
from cdpr_rt.service.lease import LeaseError
from cdpr_rt.service.setpoint_stream import StreamSessionManager
from cdpr_rt.service.stream_packet import Bye, StreamSession, StreamSetpoint, seal
from tests.tools.daemon.loop_rig import LoopRig, opened
from tests.tools.robot_rig import robot_file, simulated

PERIOD_S = 2e-3
PERIOD_NS = round(PERIOD_S * 1e9)
TAKINGS = 1000
SEED = 20260
TTL_S = 0.5
SPEED_rad_s = 0.5
STEP_rad_s = 1.0 / 13.0
"""Largest speed change of an axis per cycle, also for a correction at the target."""
KEPT = 64


@pytest.fixture(scope="module")
def rig(tmp_path_factory: pytest.TempPathFactory) -> Iterator[LoopRig]:
    drives = [("can0", 1), ("can0", 2)]
    folder = tmp_path_factory.mktemp("robot")
    path = robot_file(folder, drives, period_s=PERIOD_S)
    with simulated(path) as url, opened(path, url) as made:
        yield made


JOG = {"velocity_rad_s": [2.0, 2.0], "timeout_s": 2.0}


def change_hands(rig: LoopRig) -> int:
    """Let another client take the right before the loop checks again. Return the old number."""
    before = rig.right
    rig.drop_right()
    rig.take_right()
    return before


def test_motion_ends_when_the_right_changes_hands_between_two_checks(rig: LoopRig) -> None:
    rig.obeyed("enable", program="jog", wanted=JOG)
    rig.run(0.4)
    before = change_hands(rig)
    rows = rig.run(0.2)
    assert np.all(np.diff(rows["setpoint_velocity_rad_s"], axis=0) <= 0.0)
    assert np.all(rows["setpoint_velocity_rad_s"][-1] == 0.0)
    assert (rig.status["state"], rig.status["program"]) == ("active", "hold")
    assert (
        rig.status["reason"] == "jog: another client has taken the right to move; the robot holds"
    )
    for do in ("program", "set"):
        answer = rig.command(do, program="jog", wanted=JOG, right=before)
        assert answer["text"] == f"{do}: another client has the right to move now"
    rig.obeyed("program", program="jog", wanted=JOG)
    rig.obeyed("disable")


def test_enabling_under_a_lost_right_ends_with_a_hold(rig: LoopRig) -> None:
    what = {"do": "enable", "program": "jog", "wanted": JOG, "right": rig.right}
    number = rig.block.post_command(what)
    rig.turn_until(lambda: rig.state is LoopState.ACTIVE)
    assert not rig.loop.engine.driving
    change_hands(rig)
    rig.turn_until(lambda: not rig.loop.busy)
    answer = rig.block.take_reply()
    assert answer is not None
    assert (answer["to"], answer["ok"]) == (number, False)
    assert answer["text"] == "jog: another client has the right to move now; the robot holds"
    assert (rig.status["state"], rig.status["program"]) == ("active", "hold")
    # cogging moves an axis without power: hold brakes that motion and adds none
    speeds = np.abs(rig.run(0.2)["setpoint_velocity_rad_s"])
    assert np.all(np.diff(speeds, axis=0) <= 0.0)
    assert np.all(speeds[0] < 0.5 * np.array(JOG["velocity_rad_s"]))
    assert np.all(speeds[-1] == 0.0)
    rig.obeyed("disable")


@dataclass
class Client:
    """A client that takes the right and does not notice when it has lost it."""

    name: str
    sign: int
    port: int
    token: str = ""
    session: StreamSession | None = None
    sequence: int = 0
    place_m: float = 0.0


@dataclass
class Scene:
    """The holder of the right as the test knows it, and the messages so far."""

    rig: LoopRig
    rng: random.Random
    holder: Client | None = None
    number: int = 0
    until_ns: int = 0
    ordered: bool = False
    """Whether the holder has requested motion under the present grant."""
    tokens: list[str] = field(default_factory=list)
    orders: list[dict[str, Any]] = field(default_factory=list)
    packets: list[tuple[bytes, int]] = field(default_factory=list)
    in_between: Callable[[], object] | None = None
    """A function that runs while the loop checks the right."""
    speed: float = 0.0
    driven: int = 0
    stopped: int = 0
    """Cycles that moved for the holder, and grants that stopped another client's motion."""

    def __post_init__(self) -> None:
        self.sessions = StreamSessionManager(self.rig.block, self.rig.lease)
        self.rig.loop.engine.right._clock_ns = self.clock_ns

    def clock_ns(self) -> int:
        in_between, self.in_between = self.in_between, None
        if in_between is not None:
            in_between()
        return self.rig.now_ns

    # -- the right

    def take(self, client: Client, lapsed: bool) -> None:
        """End the present right by release or silence, and let `client` take it."""
        if self.holder is not None and not lapsed:
            self.rig.lease.release(self.holder.token)
        elif self.holder is not None:
            self.rig.now_ns = self.until_ns + self.rng.randrange(2)
        client.token = self.rig.lease.take(client.name, TTL_S)
        client.session = None
        self.holder, self.ordered = client, False
        self.number += 1
        self.until_ns = self.rig.now_ns + round(TTL_S * 1e9)
        self.tokens = [*self.tokens[-KEPT:], client.token]

    def asked(self, client: Client, do: str, **what: Any) -> dict[str, Any] | None:
        """Return the command that the service posts for a request, None if it rejects it."""
        try:
            number = self.rig.lease.renew(client.token).number
        except LeaseError:
            assert client is not self.holder
            return None
        assert client is self.holder
        self.until_ns = self.rig.now_ns + round(TTL_S * 1e9)
        command = {"do": do, "client": client.name, "right": number, **what}
        self.orders = [*self.orders[-KEPT:], command]
        return command

    def send(self, client: Client) -> None:
        """Stream the next set-point if the client has a session."""
        session = client.session
        if session is None:
            return
        client.sequence += 1
        client.place_m += client.sign * 2e-5
        packet = StreamSetpoint(
            session.number, client.sequence, self.rig.now_ns, (client.place_m, 0.0, 0.0)
        )
        data = seal(packet, session.key)
        self.packets = [*self.packets[-KEPT:], (data, client.port)]
        posted = int(self.rig.block.counters["samples"][0])
        self.sessions.receive(data, ("127.0.0.1", client.port), self.rig.now_ns)
        if int(self.rig.block.counters["samples"][0]) > posted:
            self.until_ns = self.rig.now_ns + round(TTL_S * 1e9)

    # -- cycles

    def turn(self) -> None:
        """Run one cycle and check its commands."""
        loop = self.rig.loop
        self.rig.now_ns += PERIOD_NS
        loop.turn()
        if self.in_between is not None:  # the loop has not checked meanwhile
            self.clock_ns()
        while self.rig.block.take_reply() is not None:
            pass
        assert (loop.life.state, loop.engine.driving) == (LoopState.ACTIVE, True), loop.life.reason
        before, self.speed = self.speed, float(loop.engine.setpoint.velocity_rad_s[0])
        assert loop.engine.setpoint.velocity_rad_s[1] == 0.0, "the attacker's axis moved"
        if abs(self.speed) <= STEP_rad_s:
            return
        brakes = before * self.speed > 0.0 and abs(self.speed) < abs(before)
        if not brakes:
            holds = self.holder is not None and self.rig.now_ns < self.until_ns
            assert holds and self.ordered, f"{self.speed} rad/s are nobody's"
            assert self.holder is not None
            assert self.speed * self.holder.sign > 0.0, f"{self.speed} rad/s, {self.holder.name}"
            assert loop.engine.right.mover == self.number
            self.driven += 1


def moves(scene: Scene, client: Client) -> None:
    """Let a client that believes to hold the right request motion in one of several ways."""
    rng = scene.rng
    speed = client.sign * SPEED_rad_s * rng.uniform(0.5, 1.0)
    jog = {"velocity_rad_s": [speed, 0.0], "timeout_s": 2.0}
    (way,) = rng.choices(("jog", "stream", "set", "enable"), (4, 4, 2, 1))
    if way == "stream" and client is scene.holder:
        client.session = scene.sessions.issue(client.token)
        client.sequence, client.place_m = 0, 0.0
        command = scene.asked(client, "program", program="follow")
    elif way == "set":
        command = scene.asked(client, "set", wanted=jog)
    else:
        do = "enable" if way == "enable" else "program"
        command = scene.asked(client, do, program="jog", wanted=jog)
    if command is None:
        return
    if rng.random() < 0.2:  # the right changes hands between the checks of service and loop
        late, other = client, rng.choice([one for one in CLIENTS if one is not client])
        scene.take(other, lapsed=rng.random() < 0.5)
        assert scene.holder is not late
    else:
        scene.ordered = True
    scene.rig.block.post_command(command)


def attacks(scene: Scene) -> None:
    """Guess, replay and forge. None may move axis 1, or axis 0 under another's right."""
    scene.rng.choice((guesses, replays_orders, makes_orders, replays_packets, forges))(scene)


def guesses(scene: Scene) -> None:
    held = None if scene.holder is None else scene.holder.token
    for token in (scene.rng.randbytes(18).hex(), "", scene.rng.choice(scene.tokens)):
        for use in (scene.rig.lease.renew, scene.rig.lease.release, scene.sessions.issue):
            if token != held:
                with pytest.raises(LeaseError):
                    use(token)


def replays_orders(scene: Scene) -> None:
    past = [order for order in scene.orders if order["right"] != scene.number]
    for order in scene.rng.sample(past, min(2, len(past))):
        scene.rig.block.post_command(order)


def makes_orders(scene: Scene) -> None:
    wanted = {"velocity_rad_s": [0.0, SPEED_rad_s], "timeout_s": 2.0}
    number = scene.rng.choice((scene.number - 1, 0, -1, 1 << 62, True, "1", None))
    do = scene.rng.choice(("program", "set", "enable"))
    order = {"do": do, "program": "jog", "wanted": wanted, "right": number}
    scene.rig.block.post_command(order)


def replays_packets(scene: Scene) -> None:
    for data, port in scene.rng.sample(scene.packets, min(8, len(scene.packets))):
        address = "127.0.0.1", scene.rng.choice((port, ATTACKER.port))
        scene.sessions.receive(data, address, scene.rig.now_ns)


def forges(scene: Scene) -> None:
    sessions = [one.session.number for one in CLIENTS if one.session is not None]
    session = scene.rng.choice([scene.rng.randrange(1, 1 << 32), *sessions])
    packet = StreamSetpoint(session, scene.rng.randrange(1 << 20), 1, (0.0, 0.1, 0.0))
    for forged in (packet.pack(), *(seal(packet, key) for key in (bytes(32), b""))):
        assert (
            scene.sessions.receive(forged, ("127.0.0.1", ATTACKER.port), scene.rig.now_ns) is None
        )
    goodbye = seal(Bye(session, 1 << 30), bytes(32))
    scene.sessions.receive(goodbye, ("127.0.0.1", ATTACKER.port), scene.rig.now_ns)


CLIENTS = Client("forwards", 1, 4001), Client("backwards", -1, 4002)
ATTACKER = Client("attacker", 0, 666)


@pytest.mark.long
def test_no_motion_continues_under_the_right_of_another_client(rig: LoopRig) -> None:
    print(f"seed {SEED}")
    rig.obeyed("enable")
    scene = Scene(rig, random.Random(SEED), number=rig.right)
    rig.run(0.5)
    rig.drop_right()
    rng = scene.rng
    while scene.number < TAKINGS:
        nobody_moved = abs(scene.speed) <= STEP_rad_s
        client = ATTACKER if rng.random() < 0.1 else rng.choice(CLIENTS)
        lapsed = rng.random() < 0.5
        if rng.random() < 0.4:
            scene.in_between = lambda client=client, lapsed=lapsed: scene.take(client, lapsed)
        else:
            scene.take(client, lapsed)
        scene.stopped += not nobody_moved
        for _ in range(rng.randrange(1, 24)):
            scene.turn()
            for one in CLIENTS:  # a client that has lost the right continues unchanged
                scene.send(one)
                if rng.random() < (0.1 if scene.ordered else 0.5):
                    moves(scene, one)
            if rng.random() < 0.15:
                attacks(scene)
    counts = rig.loop.engine.parts.programs["follow"].progress()
    print(f"{scene.number} grants, {scene.stopped} in motion, {scene.driven} cycles moved")
    print(f"packets {dict(scene.sessions.counts)}, samples {counts}")
    assert scene.driven > TAKINGS
    assert scene.stopped > TAKINGS // 8
    assert np.ptp(rig.rows()["setpoint_rad"][:, 1]) < 0.02
