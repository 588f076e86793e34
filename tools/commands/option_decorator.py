"""A decorator by which several commands share options: declared, and made use of, in one place."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import AbstractContextManager
from functools import wraps
from inspect import Parameter, Signature, signature
from typing import Any


def shares(
    options: Callable[..., AbstractContextManager[tuple[Any, ...]]],
) -> Callable[[Callable[..., None]], Callable[..., None]]:
    """Return a decorator of commands for typer that adds the parameters of `options` to theirs.

    The command runs inside of the context that `options` returns; what that yields are its first
    arguments, its own it gets by keyword. Parameters that must be given come before all of its own.
    """

    def parameters(function: Callable[..., Any]) -> list[Parameter]:
        declared = signature(function, eval_str=True).parameters.values()
        return [one.replace(kind=Parameter.KEYWORD_ONLY) for one in declared]

    shared = parameters(options)

    def decorate(command: Callable[..., None]) -> Callable[..., None]:
        @wraps(command)
        def run(**given: Any) -> None:
            with options(**{one.name: given.pop(one.name) for one in shared}) as first:
                command(*first, **given)

        own = parameters(command)[2:]
        needed = [one for one in shared if one.default is Parameter.empty]
        signed = [*needed, *own, *(one for one in shared if one not in needed)]
        run.__signature__ = Signature(signed)  # type: ignore[attr-defined]
        run.__annotations__ = {one.name: one.annotation for one in signed}
        return run

    return decorate
