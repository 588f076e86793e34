"""Options that take several numbers, which may be negative: `--to -100 200`."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import Any

from typer.core import TyperCommand
from typing_extensions import override

from cdpr_tools.errors import BadInputError


def numbers_command(*options: str) -> type[TyperCommand]:
    """Return the class of a command whose `options` take all following numbers."""

    class _NumbersCommand(TyperCommand):
        @override
        def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
            """Join each of these options with its numbers, including negative ones."""
            joined: list[str] = []
            takes = False
            for word in args:
                if takes and is_number(word):
                    joined[-1] += f" {word}" if "=" in joined[-1] else f"={word}"
                else:
                    takes = word in options
                    joined.append(word)
            return super().parse_args(ctx, joined)

    return _NumbersCommand


def numbers(
    option: str,
    text: str,
    names: Sequence[str],
    unit: str,
    factor: float,
    words: Iterable[str] = (),
) -> list[float]:
    """Return the numbers of an option in SI, one for each name; raises BadInputError.

    `words` are other values that are allowed.
    """
    allowed = ", or ".join([f"{' '.join(names).upper()} in {unit}", *words])
    typed = text.split()
    for word in typed:
        if not is_number(word):
            raise BadInputError(f"{option} {text}: {word!r} is not a number; allowed: {allowed}")
    if len(typed) != len(names):
        many = "1 number" if len(typed) == 1 else f"{len(typed)} numbers"
        raise BadInputError(f"{option} {text}: {many}; allowed: {len(names)}, {allowed}")
    values = [float(word) for word in typed]
    if not all(map(math.isfinite, values)):
        raise BadInputError(f"{option} {text}: allowed: finite numbers, {allowed}")
    return [factor * value for value in values]


def is_number(word: str) -> bool:
    """Whether a word is a number."""
    try:
        float(word)
    except ValueError:
        return False
    return True
