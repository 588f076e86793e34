"""Motors, drives, winches, cables and robots as validated data."""

from importlib import import_module
from importlib.util import find_spec
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from cdpr_profiles.public import *  # noqa: F403  # its __all__ is the list


def __getattr__(name: str) -> Any:
    """Import the models on first use, so that programs that need only the errors skip pydantic."""
    # the import system asks for `__path__`, and for a module that is about to be imported
    if name.startswith("_") or find_spec(f"{__name__}.{name}"):
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"{__name__}.public"), name)
