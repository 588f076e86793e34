"""Settings of a command, stored beside its measurements and read again later."""

from __future__ import annotations

from pathlib import Path
from typing import TypeVar

from pydantic import TypeAdapter, ValidationError

from cdpr_profiles.bounded_input import read_json
from cdpr_profiles.errors import ProfileError, brief
from cdpr_profiles.reader import dotted
from cdpr_tools.errors import BadInputError

_T = TypeVar("_T")


def load_settings(path: Path, kind: type[_T]) -> _T:
    """Return a dataclass from its JSON file; raises BadInputError that names file, key, value."""
    try:
        return TypeAdapter(kind).validate_python(read_json(path))
    except ProfileError as error:
        raise BadInputError(str(error)) from None
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        value = brief(repr(first["input"]))
        raise BadInputError(
            f"{path}: {dotted(first['loc'])}: value {value}: {first['msg']}"
        ) from None
