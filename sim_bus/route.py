"""Where frames with one identifier go, and what they count."""

from __future__ import annotations

from sim_bus.bus_load import is_acyclic
from sim_bus.client import Client
from sim_bus.frame import ERR_FLAG, SYNC_ID, arbitration_key, base_id, bits_by_length
from sim_bus.node_protocol import LocalNode

_LSS_ANSWER = 0x7E4


class Route:
    """What becomes of the frames with one identifier, worked out once."""

    __slots__ = (
        *("acyclic", "bits", "clients", "configures"),
        *("key", "longest", "merges", "nodes", "sync"),
    )

    def __init__(self, can_id: int, clients: list[Client], nodes: list[LocalNode]) -> None:
        self.key = arbitration_key(can_id)
        self.bits = bits_by_length(can_id)
        # error frames are no traffic: no length is right for them
        self.longest = -1 if can_id & ERR_FLAG else 8
        self.acyclic = is_acyclic(can_id)
        self.configures = self.acyclic or base_id(can_id) == 0
        self.sync = can_id == SYNC_ID
        # bit by bit the same, sent at the same time: one frame on a wire, as LSS counts on
        self.merges = can_id == _LSS_ANSWER
        self.clients = tuple(clients)
        self.nodes = tuple(nodes)
