"""Error control of the nodes of one bus: boot-ups, heartbeats, NMT states, losses."""

from __future__ import annotations

from collections.abc import Callable

from cdpr_rt.core.clock import Clock

BOOT_UP, STOPPED, OPERATIONAL, PRE_OPERATIONAL = 0, 4, 5, 127
STATE_NAMES = {
    BOOT_UP: "initialising",
    STOPPED: "stopped",
    OPERATIONAL: "operational",
    PRE_OPERATIONAL: "pre-operational",
}
_TIMEOUT_PERIODS = 1.75
"""A heartbeat that is most of a period late is lost: CAN repeats what was disturbed by itself."""


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
        self.expects_boot_up = True
        """Whether its next boot-up is expected; at first it is, as it may just be switched on."""
        self.started = False
        """Whether it has been seen operational since it was started."""
        self.starting = False


class ErrorControl:
    """Monitors the nodes' error control messages; `alarm` is called with what must end a motion.

    `slack_s` is added to the heartbeat time-out between cycles.
    """

    def __init__(self, alarm: Callable[[str], None], clock: Clock, slack_s: float) -> None:
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
        name = f"node {node.node_id}"
        node.nmt_state = state
        node.heard_s = self._clock.now_s
        if state == BOOT_UP:
            node.boot_ups += 1
            if not node.expects_boot_up:
                self.restarted.add(node.node_id)
                self._alarm(f"{name} has restarted (unexpected boot-up message)")
            node.expects_boot_up = node.started = node.starting = False
            node.heartbeat_s = 0.0
            return
        node.heartbeats += 1
        if state == OPERATIONAL:
            node.started = node.started or node.starting
        elif node.started:
            name_of_state = STATE_NAMES.get(state, "unknown")
            self._alarm(f"{name} is not operational any more (NMT state {state}, {name_of_state})")

    # -- what the master does to a node

    def expect_reset(self, node_id: int) -> None:
        """Expect the next boot-up of a node, after a reset by this master."""
        node = self._nodes[node_id]
        node.boot_ups_at_reset = node.boot_ups
        node.expects_boot_up = True
        node.started = node.starting = False
        node.heartbeat_s = 0.0
        self.restarted.discard(node_id)

    def expect_start(self, node_id: int, heartbeat_s: float) -> None:
        """Monitor from now on that a node becomes operational, stays so and sends heartbeats."""
        node = self._nodes[node_id]
        node.starting = True
        node.heard_s = self._clock.now_s
        node.heartbeat_s = heartbeat_s

    def expect_stop(self, node_id: int) -> None:
        """Stop monitoring that a node is operational."""
        node = self._nodes[node_id]
        node.started = node.starting = False

    def release(self, node_id: int) -> None:
        """Stop monitoring a node."""
        self.expect_stop(node_id)
        self._nodes[node_id].heartbeat_s = 0.0

    # -- asking

    def wait_for_boot_up(self, node_id: int, timeout_s: float) -> bool:
        """Return whether a node has booted since `expect_reset`, waiting for it."""
        node = self._nodes[node_id]
        until_s = self._clock.now_s + timeout_s
        return self._clock.wait(lambda: node.boot_ups > node.boot_ups_at_reset, until_s)

    def wait_for_heartbeat(self, node_id: int, timeout_s: float) -> int | None:
        """Return the NMT state of a node's next heartbeat, None when none came."""
        node = self._nodes[node_id]
        before, until_s = node.heartbeats, self._clock.now_s + timeout_s
        came = self._clock.wait(lambda: node.heartbeats > before, until_s)
        return node.nmt_state if came else None

    def boot_ups_since_reset(self, node_id: int) -> int:
        """Return how often a node has booted since it was last reset by us."""
        node = self._nodes[node_id]
        return node.boot_ups - node.boot_ups_at_reset

    def nmt_state(self, node_id: int) -> int | None:
        """Return the NMT state that a node reported last, None without any message."""
        return self._nodes[node_id].nmt_state

    # -- losses between cycles

    def look_for_losses(self) -> None:
        """Raise the alarm for nodes whose heartbeat is overdue, once each.

        To be called when no message waits, so that a busy master is not taken for lost nodes.
        """
        now = self._clock.now_s
        for node in self._nodes.values():
            if not node.heartbeat_s:
                continue
            silent_s = now - node.heard_s
            if silent_s > _TIMEOUT_PERIODS * node.heartbeat_s + self._slack_s:
                self._alarm(
                    f"node {node.node_id} is lost: no heartbeat for {silent_s:.1f} s, expected "
                    f"every {node.heartbeat_s * 1e3:.0f} ms"
                )
                node.heartbeat_s = 0.0

    def restart_watch(self) -> None:
        """Restart the heartbeat time-outs (cycles monitored the heartbeats until now)."""
        for node in self._nodes.values():
            node.heard_s = self._clock.now_s
