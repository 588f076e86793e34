"""Options that take several numbers, which may be negative: `--to -100 200`."""

from __future__ import annotations

import math
import re
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
            flags = {"--help"}.union(*(p.opts for p in self.params if getattr(p, "is_flag", False)))
            joined: list[str] = []
            bare: list[str] = []
            takes = False
            for i, typed in enumerate(args):
                word = typed
                if takes and is_number(word):
                    joined[-1] += f" {word}" if "=" in joined[-1] else f"={word}"
                    continue
                before = args[i - 1] if i else ""
                if coordinate := _COORDINATE.fullmatch(word):
                    word = f"{coordinate[1]}={' '.join(args[i + 1 : i + 2])}"
                elif _COORDINATE.fullmatch(before):
                    continue
                after_option = before.startswith("--") and "=" not in before
                if _NEGATIVE.match(word) and (not after_option or before in flags):
                    bare.append(word)  # not an option, but a misplaced number
                elif bare and before == bare[-1] and not word.startswith("-"):
                    bare.append(word)
                else:
                    takes = word in options
                    joined.append(word)
            return super().parse_args(ctx, [*joined, *(["--", *bare] if bare else [])])

    return _NumbersCommand


_NEGATIVE = re.compile(r"-\.?\d")
_COORDINATE = re.compile(r"--(d?[xyz])")
_TYPED = re.compile(
    r"(?:(?P<name>[a-z]+)\s*(?P<sign>[=:])?\s*)?(?P<number>[-+]?(?:\d+\.?\d*|\.\d+))"
    r"\s*(?P<unit>mm|cm|m|deg|°)?(?![a-z\d])",
    re.IGNORECASE,
)
_FACTORS = {"m": 1e3, "cm": 10.0}


def read_point(text: str, names: Sequence[str]) -> dict[str, float]:
    """Return the coordinates that a mistyped point probably means, {} if that is not clear.

    It understands the notations of other programs: `x=1 y=2`, `1,2`, `(1, 2)`, `10mm 20mm`, `dx=5`.
    """
    found = list(_TYPED.finditer(text))
    values = [
        float(one["number"]) * _FACTORS.get((one["unit"] or "").lower(), 1.0) for one in found
    ]
    known = [(one["name"] or "").lower().removeprefix("d") for one in found]
    if set(known) <= {*names}:
        return dict(zip(known, values, strict=True)) if len({*known}) == len(known) else {}
    unnamed = not any(one["sign"] for one in found) and {*names}.isdisjoint(known)
    return dict(zip(names, values, strict=True)) if unnamed and len(values) == len(names) else {}


def point_text(values: Iterable[float]) -> str:
    """Return coordinates as they are typed."""
    return " ".join(f"{value:.6g}" for value in values)


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
            meant = read_point(text, names)
            such = ""
            if len(meant) == len(names):
                such = f", here {option} {point_text(meant[name] for name in names)}"
            raise BadInputError(
                f"{option} {text}: {word!r} is not a number; allowed: {allowed}{such}"
            )
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
