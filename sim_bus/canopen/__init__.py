"""CANopen slave (CiA 301, LSS slave of CiA 305) on which simulated devices are built."""

from cdpr_sim_bus.canopen.abort import Abort, SdoAbort
from cdpr_sim_bus.canopen.dictionary.od import DictionaryError, Entry, ObjectDictionary
from cdpr_sim_bus.canopen.dictionary.store import ParameterStore, StoreError
from cdpr_sim_bus.canopen.node import CanopenSlave
from cdpr_sim_bus.canopen.slave import NmtState, SlaveApplication

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
