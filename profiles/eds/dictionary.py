"""Electronic data sheets as dictionaries of the `canopen` package."""

from __future__ import annotations

import io
from functools import lru_cache
from pathlib import Path

import canopen
from canopen.objectdictionary import ObjectDictionary

from cdpr_profiles.eds.eds_text import Remarks, decoded_eds
from cdpr_profiles.errors import ProfileError


class _Sheet(io.StringIO):
    """What a file holds; the library looks at the name for the format."""

    name = "sheet.eds"


def load_dictionary(eds: Path, node_id: int | None = None) -> ObjectDictionary:
    """Return the objects that an EDS describes, with their defaults for a node; not to be changed.

    Raises ProfileError for a file that is none.
    """
    text = decoded_eds(eds, Remarks())
    try:
        dictionary = _imported(text, node_id)
    except Exception as error:  # whatever the library makes of a broken file
        reason = str(error).splitlines()[0] if str(error) else type(error).__name__
        raise ProfileError(
            eds, "", f"is no EDS: {reason}; what is wrong is told by: cdpr drive import {eds}"
        ) from error
    if 0x1000 not in dictionary:
        raise ProfileError(eds, "", "is no EDS of a CANopen device: object 1000h is missing")
    return dictionary


@lru_cache(maxsize=64)
def _imported(text: str, node_id: int | None) -> ObjectDictionary:
    """Return what the library makes of a sheet, once as long as it does not change."""
    return canopen.import_od(_Sheet(text), node_id)
