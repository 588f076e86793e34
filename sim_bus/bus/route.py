"""Routing of frames by identifier."""

from __future__ import annotations

from cdpr_sim_bus.bus.bus_load import is_acyclic
from cdpr_sim_bus.bus.client import Client
from cdpr_sim_bus.bus.node_protocol import LocalNode
from cdpr_sim_bus.frame import ERR_FLAG, SYNC_ID, arbitration_key, base_id, bits_by_length

_LSS_ANSWER = 0x7E4


class Route:
    """Receivers and lengths in bits of the frames with one identifier."""

    __slots__ = (
        *("acyclic", "bits", "clients", "configures"),
        *("key", "longest", "merges", "nodes", "sync"),
    )

    def __init__(self, can_id: int, clients: list[Client], nodes: list[LocalNode]) -> None:
        self.key = arbitration_key(can_id)
        self.bits = bits_by_length(can_id)
        # error frames are no traffic: they have no length
        self.longest = -1 if can_id & ERR_FLAG else 8
        self.acyclic = is_acyclic(can_id)
        self.configures = self.acyclic or base_id(can_id) == 0
        self.sync = can_id == SYNC_ID
        # identical LSS answers at the same time are one frame on a wire
        self.merges = can_id == _LSS_ANSWER
        self.clients = tuple(clients)
        self.nodes = tuple(nodes)
