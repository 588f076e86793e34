"""CANopen slave (CiA 301, LSS slave of CiA 305) on which simulated devices are built."""

from cdpr_sim_bus.canopen.abort import Abort, SdoAbort
from cdpr_sim_bus.canopen.node import CanopenSlave
from cdpr_sim_bus.canopen.od import DictionaryError, Entry, ObjectDictionary
from cdpr_sim_bus.canopen.slave import NmtState, SlaveApplication
from cdpr_sim_bus.canopen.store import ParameterStore, StoreError

__all__ = [
    "Abort",
    "CanopenSlave",
    "DictionaryError",
    "Entry",
    "NmtState",
    "ObjectDictionary",
    "ParameterStore",
    "SdoAbort",
    "SlaveApplication",
    "StoreError",
]
