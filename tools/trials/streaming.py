"""The trial of a hand that leads through a bad network: no step in the commanded velocity."""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from cdpr_rt.exchange import FloatArray
from cdpr_rt.runtime.stream_buttons import stream_buttons
from profiles import Robot
from tools.trials.channel import Channel, Network
from tools.trials.figures import Figure
from tools.trials.recorded import Recorded
from tools.trials.run import TrialRun, platform_of

RATE_Hz: Final = 50.0
SCALE: Final = 4.0
ROUNDING_m: Final = 0.5e-9
"""Of a recorded position."""
_SENDER_AHEAD_s: Final = 1234.5
"""The hand's clock is its own."""
_MOODS_S: Final = (2.0, 6.0)
_SILENCE_S: Final = 1.2
_CLUTCH_S: Final = 0.4


class Wandering:
    """A hand's way: waves of some seconds, now and then a flick, a pause or the clutch.

    Its place and its moods are made of `chance`; it goes as far as `reach_m` (2,) of the hand's
    own space, and at times faster than any robot.
    """

    def __init__(self, chance: np.random.Generator, reach_m: FloatArray) -> None:
        self._chance = chance
        self._reach = reach_m
        self._rates = chance.uniform(0.3, 1.6, (3, 2))
        self._phases = chance.uniform(0.0, math.tau, (3, 2))
        self._shift = np.zeros(2)
        self._until_s = 0.0
        self.mood = "waves"

    def at(self, time_s: float) -> FloatArray:
        """Return where the hand is, (2,), and choose what it is about to do."""
        if time_s >= self._until_s:
            self._change(time_s)
        waves = np.sin(self._rates * time_s + self._phases).mean(axis=0)
        return np.asarray(self._reach * (waves + self._shift))

    def _change(self, time_s: float) -> None:
        chance = self._chance
        self.mood = str(chance.choice(["waves", "flick", "clutch", "silence"]))
        lasts = {"clutch": _CLUTCH_S, "silence": _SILENCE_S}
        self._until_s = time_s + lasts.get(self.mood, chance.uniform(*_MOODS_S))
        if self.mood == "flick":
            self._shift = chance.uniform(-0.5, 0.5, 2)


def drive(run: TrialRun, seconds: float) -> None:
    """Lead the platform by a hand at 50 Hz, through the network."""
    rig, chance = run.rig, run.chance
    network = Network()
    channel = Channel(network, chance)
    way = Wandering(chance, (run.high_m - run.low_m) / (2.0 * SCALE))
    hand = rig.stream.hand()
    rig.program("pose", stream=True)
    between = round(1.0 / (RATE_Hz * rig.period_s))
    cycles = round(seconds / rig.period_s)
    for cycle in range(cycles):
        if cycle % between == 0:
            place = way.at(rig.now_s)
            if way.mood != "silence":
                buttons = stream_buttons(way.mood == "clutch", 0)
                sent_s = rig.now_s + _SENDER_AHEAD_s
                packet = hand.packet(sent_s, (*place, 0.0), SCALE, buttons)
                channel.send(packet, rig.now_s)
        for packet in channel.arrived(rig.now_s):
            rig.stream.take(packet)
        rig.turn()
        if cycle % 1000 == 0:
            run.stay(0.0)
    counts = {key: int(value) for key, value in rig.stream.desk.counts.items() if value}
    run.mark(
        "network",
        sent=channel.sent,
        lost=channel.lost,
        doubled=channel.doubled,
        overtaken=channel.overtaken,
        taken=counts,
    )


def velocity_steps_m_s(recorded: Recorded) -> FloatArray:
    """Return by how much the commanded velocity changes from each cycle to the next, (k, 2)."""
    velocity = np.diff(recorded.setpoint_m, axis=0) / recorded.period_s
    return np.asarray(np.diff(velocity, axis=0))


def judge(recorded: Recorded, robot: Robot) -> list[Figure]:
    """Return the network's figures and the greatest step of the commanded velocity."""
    platform = platform_of(robot)
    (network,) = recorded.marked("network")
    steps = np.abs(velocity_steps_m_s(recorded))
    velocity = np.abs(np.diff(recorded.setpoint_m, axis=0)) / recorded.period_s
    # a step is made of three positions, the middle one counted twice
    rounding_m_s = 4.0 * ROUNDING_m / recorded.period_s
    allowed = 1e3 * (platform.acceleration_m_s2 * recorded.period_s + rounding_m_s)
    way = float(np.linalg.norm(np.diff(recorded.setpoint_m, axis=0), axis=1).sum())
    off = np.linalg.norm(recorded.true_m - recorded.setpoint_m, axis=1)
    sent = network["sent"]
    return [
        Figure("sent", "set-points sent", sent),
        Figure("lost", "of them lost", 100.0 * network["lost"] / sent, "%"),
        Figure("doubled", "came twice", 100.0 * network["doubled"] / sent, "%"),
        Figure("overtaken", "overtaken by later ones", 100.0 * network["overtaken"] / sent, "%"),
        Figure("way_m", "way of the set-point", way, "m"),
        Figure("speed_m_s", "fastest set-point in x or y", float(velocity.max()), "m/s"),
        Figure(
            "step_mm_s",
            "greatest step of velocity in a cycle",
            1e3 * float(steps.max()),
            "mm/s",
            allowed,
        ),
        Figure("off_rms_mm", "RMS distance from the set-point", 1e3 * _rms(off), "mm"),
        Figure("off_mm", "worst distance from the set-point", 1e3 * float(off.max()), "mm"),
    ]


def _rms(values: FloatArray) -> float:
    return float(np.sqrt(np.mean(values**2)))
