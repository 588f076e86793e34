"""Motors, drives, winches, cables and robots as validated data."""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from cdpr_profiles.public import *  # noqa: F403  # its __all__ is the list


def __getattr__(name: str) -> Any:
    """Import the models when one is asked for: who needs only the errors is spared pydantic."""
    if name.startswith("_"):  # as `__path__`, which the import itself asks for
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"{__name__}.public"), name)
