"""Verify configuration (1020h): the date and time of a configuration, void once it is changed."""

from __future__ import annotations

from cdpr_sim_bus.canopen.dictionary.datatypes import Value
from cdpr_sim_bus.canopen.dictionary.od import APPLICATION, Entry, ObjectDictionary
from cdpr_sim_bus.canopen.dictionary.store import ParameterStore

_VERIFY = 0x1020


class ConfigurationStamp:
    """Keeps 1020h as CiA 301 has it: 0 from the first change that follows its writing.

    A reset of communication brings back the stored date and time together with the communication
    parameters; where application parameters have changed meanwhile, which it does not bring back,
    it stays 0.
    """

    def __init__(self, od: ObjectDictionary, store: ParameterStore) -> None:
        self._od = od
        self._store = store
        self._application_changed = False

    def written(self, entry: Entry, before: Value) -> None:
        """Note that a client wrote an object that held `before`."""
        if entry.index == _VERIFY:
            self._application_changed = False
        elif entry.value != before and self._store.keeps(entry.index):
            self._application_changed = self._application_changed or entry.index in APPLICATION
            self._clear()

    def reset_node(self) -> None:
        """All parameters are the stored ones again."""
        self._application_changed = False

    def reset_communication(self) -> None:
        """The communication parameters are the stored ones again."""
        if self._application_changed:
            self._clear()

    def _clear(self) -> None:
        for entry in self._od.subs(_VERIFY):
            entry.value = 0
