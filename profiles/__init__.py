"""Motors, drives, winches, cables and robots as validated data."""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from cdpr_profiles.public import *  # noqa: F403  # its __all__ is the list


def __getattr__(name: str) -> Any:
    """Import the models on first use, so that programs that need only the errors skip pydantic."""
    if name.startswith("_"):  # for example `__path__`, which the import system requests
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"{__name__}.public"), name)
