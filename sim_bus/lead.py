"""The master that leads a bus in lockstep: bus time moves as it says, and it is told the time."""

from __future__ import annotations

import math
import struct
import time
from typing import Any

from sim_bus.client import Client
from sim_bus.clock import BusClock, ClockMode
from sim_bus.switch import Switch

_PACKET = struct.Struct("<8sdd")
_GO, _TIME = b"bus-go\0\0", b"bus-time"
_STEPS_A_TURN = 16


def is_go(packet: bytes) -> bool:
    """Return whether a packet is a go."""
    return len(packet) == _PACKET.size and packet.startswith(_GO)


class Lead:
    """Who leads the bus, and the go that is being carried out."""

    def __init__(self, switch: Switch, clock: BusClock) -> None:
        self._switch = switch
        self._clock = clock
        self.leader: Client | None = None
        self.until_s: float | None = None
        """Bus time to which a go lets the bus run, None while none does."""
        self.owed = False
        """Whether the leader's socket had no room for a time packet."""

    def take(self, client: Client) -> dict[str, Any]:
        """Have `client` lead from now on; return what to answer."""
        clock = self._clock
        if clock.mode is ClockMode.PACED:
            return {"error": "lead: this bus is paced, its time is the clock's"}
        if self.leader not in (None, client):
            return {"error": "lead: another client leads this bus"}
        clock.stand(time.monotonic())
        now_s = clock.now(0.0)
        self._switch.advance(now_s)
        self._switch.settle()
        self.leader = client
        client.told = False
        next_s = self._switch.next_event_s()
        return {"lead": {"now_s": now_s, "next_s": None if next_s == math.inf else next_s}}

    def give_back(self, client: Client) -> None:
        """Have `client` lead no more; bus time stands until somebody speaks or leads."""
        if client is self.leader:
            self._end()

    def lose(self, client: Client) -> None:
        """Let bus time run with the wall when a leader that has gone is `client`."""
        if client is self.leader:
            self._end()
            self._clock.run(time.monotonic())

    def _end(self) -> None:
        self.leader = self.until_s = None
        self.owed = False

    def go(self, packet: bytes) -> None:
        """Take a go of the leader; `go_on` carries it out. One without a finite time is a fence."""
        until_s = _PACKET.unpack(packet)[1]
        self.until_s = until_s if math.isfinite(until_s) else -math.inf

    def go_on(self) -> None:
        """Let bus time go from event to event as far as a go allows, a part of the way at a time.

        Pay the time packet that the leader had no room for.
        """
        leader, until_s, switch, clock = self.leader, self.until_s, self._switch, self._clock
        if self.owed:
            self.tell()
        if leader is None or until_s is None:
            return
        for _ in range(_STEPS_A_TURN):
            now_s = clock.now(0.0)
            if leader.told or until_s <= now_s:
                self.until_s = None
                self.tell()
                return
            step_s = max(now_s, min(switch.next_event_s(), until_s))
            clock.move(step_s)
            switch.advance(step_s)
            switch.settle()

    def tell(self) -> None:
        """Send the leader the time, now or as soon as its socket has room."""
        leader = self.leader
        if leader is None:
            return
        packet = _PACKET.pack(_TIME, self._clock.now(0.0), self._switch.next_event_s())
        self.owed = False
        try:
            leader.sock.send(packet)
            leader.told = False
        except BlockingIOError:
            self.owed = True
        except OSError:
            # it has gone; reading from it tells
            return
