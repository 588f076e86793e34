"""Error control of the nodes of one bus: boot-ups, heartbeats, NMT states, losses."""

from __future__ import annotations

from collections.abc import Callable

from cdpr_profiles.robot_limits import Limit
from cdpr_rt.core.clock import Clock
from cdpr_rt.core.fault import Fault

BOOT_UP, STOPPED, OPERATIONAL, PRE_OPERATIONAL = 0, 4, 5, 127
NMT_STATES = {
    BOOT_UP: "boot-up",
    STOPPED: "stopped",
    OPERATIONAL: "operational",
    PRE_OPERATIONAL: "pre-operational",
}


def nmt_name(state: int) -> str:
    """Return the name of an NMT state."""
    return NMT_STATES.get(state, f"in the unknown state {state}")


_TIMEOUT_PERIODS = 1.75
"""A heartbeat late by most of a period was not sent: CAN repeats disturbed frames itself."""


class _Node:
    """State of one node from its error control messages."""

    def __init__(self, node_id: int) -> None:
        self.node_id = node_id
        self.boot_ups = 0
        self.boot_ups_at_reset = 0
        self.heartbeats = 0
        self.heard_s = 0.0
        self.heartbeat_s = 0.0
        """Expected period between cycles, 0 while not monitored."""
        self.nmt_state: int | None = None
        self.boot_ups_expected = 1
        """Boot-ups still expected; initially one, because the node may just power up."""
        self.started = False
        """Whether the node was seen operational since it was started."""
        self.starting = False


class ErrorControl:
    """Monitors the nodes' error control messages; calls `alarm` for events that must end a motion.

    `slack_s` is added to the heartbeat timeout between cycles.
    """

    def __init__(self, alarm: Callable[[Fault], None], clock: Clock, slack_s: float) -> None:
        self.restarted: set[int] = set()
        """Nodes that restarted unexpectedly: their configuration and encoder positions are void."""
        self._alarm = alarm
        self._clock = clock
        self._slack_s = slack_s
        self._nodes: dict[int, _Node] = {}

    def add(self, node_id: int) -> None:
        """Start monitoring a node."""
        self._nodes[node_id] = _Node(node_id)

    def take(self, node_id: int, state: int) -> None:
        """Process an error control message: an NMT state, 0 for a boot-up."""
        node = self._nodes[node_id]
        source = f"node {node_id}"
        node.nmt_state = state
        node.heard_s = self._clock.now_s
        if state == BOOT_UP:
            node.boot_ups += 1
            if not node.boot_ups_expected:
                self.restarted.add(node.node_id)
                self._alarm(Fault(Limit.DRIVE, -1, "restarted", source))
            node.boot_ups_expected = max(0, node.boot_ups_expected - 1)
            node.started = node.starting = False
            node.heartbeat_s = 0.0
            return
        node.heartbeats += 1
        if state == OPERATIONAL:
            node.started = node.started or node.starting
        elif node.started:
            figures = float(state), float(OPERATIONAL)
            name = nmt_name(state)
            self._alarm(Fault(Limit.DRIVE, -1, "not_operational", source, *figures, name))

    # -- commands of the master to a node

    def expect_reset(self, node_id: int, boot_ups: int = 1) -> None:
        """Expect the next boot-ups of a node, after a reset by this master."""
        node = self._nodes[node_id]
        node.boot_ups_at_reset = node.boot_ups
        node.boot_ups_expected = boot_ups
        node.started = node.starting = False
        node.heartbeat_s = 0.0
        self.restarted.discard(node_id)

    def expect_start(self, node_id: int, heartbeat_s: float) -> None:
        """Monitor from now on that a node becomes and stays operational, and sends heartbeats."""
        node = self._nodes[node_id]
        node.starting = True
        node.boot_ups_expected = 0
        node.heard_s = self._clock.now_s
        node.heartbeat_s = heartbeat_s

    def expect_stop(self, node_id: int) -> None:
        """Stop monitoring whether a node is operational."""
        node = self._nodes[node_id]
        node.started = node.starting = False

    def release(self, node_id: int) -> None:
        """Stop monitoring a node."""
        self.expect_stop(node_id)
        self._nodes[node_id].heartbeat_s = 0.0

    # -- queries

    def wait_for_boot_up(self, node_id: int, timeout_s: float) -> bool:
        """Wait for a node's boot-ups; return whether it has booted since `expect_reset`.

        If the boot-ups do not come in time, they are no longer expected.
        """
        node = self._nodes[node_id]
        until_s = self._clock.now_s + timeout_s
        self._clock.wait(lambda: not node.boot_ups_expected, until_s)
        booted = node.boot_ups > node.boot_ups_at_reset
        node.boot_ups_expected = 0 if booted else node.boot_ups_expected
        return booted

    def wait_for_heartbeat(self, node_id: int, timeout_s: float) -> int | None:
        """Return the NMT state of a node's next heartbeat; None if none arrived."""
        node = self._nodes[node_id]
        before, until_s = node.heartbeats, self._clock.now_s + timeout_s
        came = self._clock.wait(lambda: node.heartbeats > before, until_s)
        return node.nmt_state if came else None

    def boot_ups_since_reset(self, node_id: int) -> int:
        """Return how often a node has booted since this master last reset it."""
        node = self._nodes[node_id]
        return node.boot_ups - node.boot_ups_at_reset

    def nmt_state(self, node_id: int) -> int | None:
        """Return the NMT state that a node last reported; None without any message."""
        return self._nodes[node_id].nmt_state

    # -- losses between cycles

    def look_for_losses(self) -> None:
        """Raise the alarm for nodes whose heartbeat is overdue, once each.

        Call it only if no message waits: otherwise a delayed master would report nodes as lost.
        """
        now = self._clock.now_s
        for node in self._nodes.values():
            if not node.heartbeat_s:
                continue
            silent_s = now - node.heard_s
            if silent_s > _TIMEOUT_PERIODS * node.heartbeat_s + self._slack_s:
                source, every_s = f"node {node.node_id}", node.heartbeat_s
                self._alarm(Fault(Limit.DRIVE, -1, "no_heartbeat", source, silent_s, every_s))
                node.heartbeat_s = 0.0

    def restart_watch(self) -> None:
        """Restart the heartbeat timeouts (until now the cycles monitored the heartbeats)."""
        for node in self._nodes.values():
            node.heard_s = self._clock.now_s
