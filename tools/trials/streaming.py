"""Trial of teleoperation over a bad network: the velocity must not step."""

from __future__ import annotations

import heapq
import math
from dataclasses import dataclass
from itertools import count
from typing import Final

import numpy as np
from scipy.spatial.transform import Rotation

from cdpr_rt.arrays import FloatArray, rms
from cdpr_rt.motion.pose_stream import stream_buttons
from cdpr_tools.trials.directions import Directions
from cdpr_tools.trials.figures import Figure
from cdpr_tools.trials.recorded import Recorded
from cdpr_tools.trials.run import TrialRun

# A bad network between a hand and a robot: packets are delayed, lost, duplicated or reordered.


@dataclass(frozen=True)
class Network:
    """Probabilities of loss and duplication, and one-way delays in s."""

    loss: float = 0.2
    duplicates: float = 0.1
    delay_s: float = 0.02
    jitter_s: float = 0.05
    """Largest extra delay of a packet; it lets later packets overtake."""


class Channel:
    """Holds packets until they arrive; `rng` draws loss, duplication and delay of each."""

    def __init__(self, network: Network, rng: np.random.Generator) -> None:
        self._network = network
        self._rng = rng
        self._under_way: list[tuple[float, int, bytes]] = []
        self._numbers = count()
        self._newest = -1
        self.sent = self.lost = self.doubled = self.overtaken = 0

    def send(self, packet: bytes, now_s: float) -> None:
        """Take a packet that is sent now."""
        network, rng = self._network, self._rng
        self.sent += 1
        if rng.random() < network.loss:
            self.lost += 1
            return
        copies = 1 + (rng.random() < network.duplicates)
        self.doubled += copies - 1
        number = next(self._numbers)
        for _ in range(copies):
            arrives = now_s + network.delay_s + network.jitter_s * rng.random()
            heapq.heappush(self._under_way, (arrives, number, packet))

    def arrived(self, now_s: float) -> list[bytes]:
        """Return the packets that have arrived by now, in order of arrival."""
        packets = []
        while self._under_way and self._under_way[0][0] <= now_s:
            _, number, packet = heapq.heappop(self._under_way)
            self.overtaken += number < self._newest
            self._newest = max(self._newest, number)
            packets.append(packet)
        return packets


RATE_Hz: Final = 50.0
SCALE: Final = 4.0
ROUNDING: Final = 0.5e-9
"""Rounding error of a recorded position in m, or of an entry of a quaternion."""
_SENDER_AHEAD_s: Final = 1234.5
"""Lead of the hand's clock over the robot's."""
_PHASE_S: Final = (2.0, 6.0)
_SILENCE_S: Final = 1.2
_CLUTCH_S: Final = 0.4


class RandomHandMotion:
    """A random motion of a hand: waves of some seconds, with flicks, pauses and the clutch.

    `rng` draws rates and phases. The waves extend to `reach` (d,), m or rad, in the hand's own
    space. At times they are faster than any robot.
    """

    def __init__(self, rng: np.random.Generator, reach: FloatArray) -> None:
        self._rng = rng
        self._reach = reach
        self._rates = rng.uniform(0.3, 1.6, (3, reach.size))
        self._phases = rng.uniform(0.0, math.tau, (3, reach.size))
        self._shift = np.zeros(reach.size)
        self._until_s = 0.0
        self.activity = "waves"

    def at(self, time_s: float) -> FloatArray:
        """Return the place of the hand, (d,), and choose its next activity if that is due."""
        if time_s >= self._until_s:
            self._change(time_s)
        waves = np.sin(self._rates * time_s + self._phases).mean(axis=0)
        return np.asarray(self._reach * (waves + self._shift))

    def _change(self, time_s: float) -> None:
        rng = self._rng
        self.activity = str(rng.choice(["waves", "flick", "clutch", "silence"]))
        lasts = {"clutch": _CLUTCH_S, "silence": _SILENCE_S}
        self._until_s = time_s + lasts.get(self.activity, rng.uniform(*_PHASE_S))
        if self.activity == "flick":
            self._shift = rng.uniform(-0.5, 0.5, self._shift.size)


def drive(run: TrialRun, seconds: float) -> None:
    """Lead the platform by the hand's set-points, at 50 Hz through the network."""
    rig, rng = run.rig, run.rng
    channel, directions = Channel(Network(), rng), run.directions
    reach = 0.5 * (directions.high_m - directions.low_m) / SCALE
    turned = np.full(len(directions.turns), directions.angle_rad)
    way = RandomHandMotion(rng, np.append(reach, turned))
    hand = rig.stream.sender()
    rig.program("pose", stream=True)
    between = round(1.0 / (RATE_Hz * rig.period_s))
    cycles = round(seconds / rig.period_s)
    for cycle in range(cycles):
        if cycle % between == 0:
            place = way.at(rig.now_s)
            if way.activity != "silence":
                buttons = stream_buttons(way.activity == "clutch", 0)
                sent_s = rig.now_s + _SENDER_AHEAD_s
                position_m, quaternion = hand_pose(directions, place)
                packet = hand.packet(sent_s, position_m, SCALE, buttons, quaternion)
                channel.send(packet, rig.now_s)
        for packet in channel.arrived(rig.now_s):
            rig.stream.take(packet)
        rig.turn()
        if cycle % 1000 == 0:
            run.stay(0.0)
    counts = {key: int(value) for key, value in rig.stream.sessions.counts.items() if value}
    run.mark(
        "network",
        sent=channel.sent,
        lost=channel.lost,
        doubled=channel.doubled,
        overtaken=channel.overtaken,
        taken=counts,
    )


def hand_pose(directions: Directions, place: FloatArray) -> tuple[list[float], list[float]]:
    """Return position (3) and quaternion (4) of a hand at a place; its rotation at home is zero."""
    rotation = directions.rotations(place[None])[0] @ directions.home_rotation.T
    x, y, z, w = Rotation.from_matrix(rotation).as_quat().tolist()
    position_m = place[: directions.k].tolist() + [0.0] * (3 - directions.k)
    return position_m, [w, x, y, z]


def velocity_steps(recorded: Recorded) -> FloatArray:
    """Return the change of the commanded velocity from each cycle to the next, (c, d)."""
    velocity = np.diff(recorded.setpoint_places, axis=0) / recorded.period_s
    return np.asarray(np.diff(velocity, axis=0))


def angle_rounding(most_rad: float) -> float:
    """Return the largest error of a rotation vector's entry per error of a quaternion's entries.

    The vector is θ n = 2 atan2(s, w) n with s n = v, its length at most `most_rad`. Derivatives by
    the entries of v are (θ/s) (δ_ij - n_i n_j) + 2 w n_i n_j, together at most 1.5 θ/s - w; by w,
    at most 2 s.
    """
    half = max(0.5 * most_rad, 1e-9)
    return 3.0 * half / math.sin(half) - math.cos(half) + 2.0 * math.sin(half)


def judge(recorded: Recorded) -> list[Figure]:
    """Return the network's figures and the greatest step of the commanded velocity."""
    directions, k = recorded.directions, recorded.directions.k
    (network,) = recorded.marked("network")
    steps = np.abs(velocity_steps(recorded)).max(axis=0)
    velocity = np.abs(np.diff(recorded.setpoint_m, axis=0)) / recorded.period_s
    # a step is computed from three positions, the middle one counted twice
    rounding = 4.0 / recorded.period_s * np.full(directions.d, ROUNDING)
    rounding[k:] *= angle_rounding(directions.angle_rad)
    allowed = directions.acceleration * recorded.period_s + rounding
    way = float(np.linalg.norm(np.diff(recorded.setpoint_m, axis=0), axis=1).sum())
    off = np.linalg.norm(recorded.true_m - recorded.setpoint_m, axis=1)
    sent = network["sent"]
    figures = [
        Figure("sent", "set-points sent", sent),
        Figure("lost", "packets lost", 100.0 * network["lost"] / sent, "%"),
        Figure("doubled", "came twice", 100.0 * network["doubled"] / sent, "%"),
        Figure(
            "overtaken", "packets overtaken by later ones", 100.0 * network["overtaken"] / sent, "%"
        ),
        Figure("way_m", "path length of the set-point", way, "m"),
        Figure("speed_m_s", "fastest set-point along a direction", float(velocity.max()), "m/s"),
        Figure(
            "step_mm_s",
            "greatest step of velocity in a cycle",
            1e3 * float(steps[:k].max()),
            "mm/s",
            1e3 * float(allowed[:k].min()),
        ),
        Figure("off_rms_mm", "RMS distance from the set-point", 1e3 * rms(off), "mm"),
        Figure("off_mm", "worst distance from the set-point", 1e3 * float(off.max()), "mm"),
    ]
    if directions.angle_rad > 0.0:
        angle = np.degrees(np.linalg.norm(recorded.turned_off_rad, axis=1))
        text, step = "greatest step of angular velocity in a cycle", float(steps[k:].max())
        limit = float(np.degrees(allowed[k:].min()))
        figures += [
            Figure("step_deg_s", text, math.degrees(step), "deg/s", limit),
            Figure("turned_off_rms_deg", "RMS angle from the set-point", rms(angle), "deg"),
        ]
    return figures
