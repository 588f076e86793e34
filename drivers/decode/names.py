"""Names and types of objects, from electronic data sheets."""

from __future__ import annotations

from functools import cache, lru_cache
from pathlib import Path
from typing import Any

import canopen
from canopen.objectdictionary import ODVariable, datatypes

from cdpr_profiles import load_drive
from cdpr_profiles.eds.dictionary import load_dictionary

_STANDARD_DRIVE = "generic-cia402"
_SIGNED = frozenset(datatypes.SIGNED_TYPES)
_INTEGERS = frozenset(datatypes.INTEGER_TYPES)


class ObjectNames:
    """What an EDS calls the objects; those it lacks are called as in the generic CiA 402 EDS."""

    def __init__(self, eds: Path | None = None) -> None:
        self._device = _dictionary(eds) if eds is not None else None
        self._standard = _standard()

    def name(self, index: int, sub: int) -> str:
        """Return an object's name, "" where no data sheet has it."""
        for dictionary in (self._device, self._standard):
            entry = dictionary.get(index) if dictionary is not None else None
            if entry is None:
                continue
            if isinstance(entry, ODVariable):
                return str(entry.name)
            part = _part(entry, sub)
            if part is None or str(part.name).startswith(str(entry.name)):
                return str((part or entry).name)
            return f"{entry.name}: {part.name}"
        return ""

    def is_signed(self, index: int, sub: int) -> bool:
        """Return whether the object is a signed integer."""
        variable = self._variable(index, sub)
        return variable is not None and variable.data_type in _SIGNED

    def is_other(self, index: int, sub: int) -> bool:
        """Return whether the object is known to be something else than an integer."""
        variable = self._variable(index, sub)
        return variable is not None and variable.data_type not in _INTEGERS

    def plain(self, index: int, sub: int, data: bytes) -> Any:
        """Return the value of an object that is no integer: text, number or the bytes."""
        variable = self._variable(index, sub)
        if variable is None:
            return data
        try:
            return variable.decode_raw(data)
        except canopen.ObjectDictionaryError:
            return data

    def _variable(self, index: int, sub: int) -> ODVariable | None:
        for dictionary in (self._device, self._standard):
            entry = dictionary.get(index) if dictionary is not None else None
            found = entry if isinstance(entry, ODVariable) or entry is None else _part(entry, sub)
            if found is not None:
                return found
        return None


def _part(entry: Any, sub: int) -> ODVariable | None:
    """Return a member of a record or array; arrays of the library invent members on demand."""
    try:
        return entry[sub]  # type: ignore[no-any-return]
    except KeyError:
        return None


@lru_cache(maxsize=32)
def _dictionary(eds: Path) -> Any:
    return load_dictionary(eds)


@cache
def _standard() -> Any:
    return _dictionary(load_drive(_STANDARD_DRIVE).eds)
