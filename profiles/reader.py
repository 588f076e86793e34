"""Read a TOML or JSON file into a validated, frozen model."""

import difflib
import json
from collections.abc import Iterable, Mapping
from datetime import datetime
from itertools import islice
from pathlib import Path
from types import UnionType
from typing import Any, Self, TypeVar, Union, get_args, get_origin

from pydantic import AfterValidator, BaseModel, ConfigDict, ValidationError
from pydantic.fields import FieldInfo
from pydantic_core import ErrorDetails

from cdpr_profiles.bounded_input import MOST_JSON_BYTES, parse_json, read_text, read_toml
from cdpr_profiles.errors import ProfileError, brief, value_text

_MOST_FAULTS = 10


class Profile(BaseModel):
    """Base of every model read from TOML: frozen, strict about types, unknown keys rejected.

    Use tuples for arrays: lists in the file become tuples.
    """

    model_config = ConfigDict(
        extra="forbid", frozen=True, strict=True, allow_inf_nan=False, hide_input_in_errors=True
    )

    @classmethod
    def load_file(cls, path: str | Path) -> Self:
        """Read a TOML file; raises ProfileError with file, key, value and what is allowed."""
        return read_toml_model(Path(path), cls)

    def toml_text(self, *comments: str) -> str:
        """Return the text of a file that `load_file` reads as this model; omit keys with None."""
        lines = [f"# {comment}" for comment in comments]
        for key, value in self.model_dump().items():
            if value is not None:
                # JSON and TOML write strings, numbers and lists of them the same way
                is_date = isinstance(value, datetime)
                text = value.isoformat() if is_date else json.dumps(value, ensure_ascii=False)
                lines.append(f"{key} = {text}")
        return "\n".join(lines) + "\n"


def require_unique(what: str, values: list[Any]) -> None:
    """Raise ValueError if one of `values` is repeated."""
    if len(set(values)) < len(values):
        raise ValueError(f"{what} {values}; allowed: each once")


def one_of(*allowed: int) -> AfterValidator:
    """Return a constraint of an integer key to some values (a Literal would accept `true` as 1)."""

    def check(value: int) -> int:
        if value not in allowed:
            raise ValueError(f"value {value}; allowed: {' or '.join(map(str, allowed))}")
        return value

    return AfterValidator(check)


_M = TypeVar("_M", bound=BaseModel)


def read_toml_model(path: Path, model: type[_M]) -> _M:
    """Return the file as an instance of `model`.

    Raises ProfileError, one line per fault, each with the key, the value and what is allowed;
    for a misspelt key it suggests the probable one.
    """
    return validated(path, read_toml(path), model)


def read_json_model(path: Path, model: type[_M], most_bytes: int = MOST_JSON_BYTES) -> _M:
    """Return a JSON file as an instance of `model`; raises ProfileError as `read_toml_model`."""
    text = read_text(path, most_bytes)
    parse_json(text, path)
    try:
        return model.model_validate_json(text)
    except ValidationError as error:
        raise _refused(path, model, error) from None


def validated(path: Path, table: Mapping[str, Any], model: type[_M]) -> _M:
    """Return `table`, read from `path`, as an instance of `model`; raises ProfileError."""
    try:
        return model.model_validate(table)
    except ValidationError as error:
        raise _refused(path, model, error) from None


def validated_cells(path: Path, line: int, cells: Mapping[str, str], model: type[_M]) -> _M:
    """Return the cells in a line of a CSV file as an instance of `model`; raises ProfileError."""
    try:
        return model.model_validate_strings(cells)
    except ValidationError as error:
        raise _refused(path, model, error, f"line {line}: ") from None


def _refused(
    path: Path, model: type[BaseModel], error: ValidationError, before: str = ""
) -> ProfileError:
    """Return the first faults of a validation as one error; `before` is put before their keys."""
    faults = _faults(model, error.errors(include_url=False))
    found = [(before + key, problem) for key, problem in islice(faults, _MOST_FAULTS + 1)]
    key, problem = found[0]
    further = [f"\n{path}: {k}: {p}" if k else f"\n{path}: {p}" for k, p in found[1:_MOST_FAULTS]]
    if len(found) > _MOST_FAULTS:
        further.append(f"\n{path}: there are more errors")
    return ProfileError(path, key, problem + "".join(further))


def closest(name: str, known: Iterable[str]) -> str | None:
    """Return the known name closest to `name`, or None."""
    by_folded = {k.casefold(): k for k in known}
    found = difflib.get_close_matches(name.casefold(), by_folded, n=1, cutoff=0.6)
    return by_folded[found[0]] if found else None


def _faults(model: type[BaseModel], errors: list[ErrorDetails]) -> Iterable[tuple[str, str]]:
    """Yield (dotted key, problem), misspelt keys first; skip missing keys that they explain."""
    explained: set[tuple[int | str, ...]] = set()
    for error in errors:
        if error["type"] == "extra_forbidden":
            loc = error["loc"]
            known = _keys_at(model, loc[:-1])
            suggestion = closest(str(loc[-1]), known)
            hint = (
                f"did you mean {suggestion!r}?"
                if suggestion
                else f"allowed: {', '.join(sorted(known))}"
            )
            if suggestion:
                explained.add((*loc[:-1], suggestion))
            yield dotted(loc), f"unknown key; {hint}"
    for error in errors:
        if error["type"] == "missing" and error["loc"] not in explained:
            yield dotted(error["loc"]), "this required key is missing"
        elif error["type"] == "value_error":
            yield dotted(error["loc"]), error["msg"].removeprefix("Value error, ")
        elif error["type"] == "too_long":
            yield dotted(error["loc"]), _count_fault(error, "up to {max_length}")
        elif error["type"] == "too_short":
            # the count leaves out rejected entries, whose faults are reported separately
            if len(error["input"]) < error["ctx"]["min_length"]:
                yield dotted(error["loc"]), _count_fault(error, "{min_length} or more")
        elif error["type"] not in ("missing", "extra_forbidden"):
            allowed = error["msg"].removeprefix("Input should be ")
            allowed = "an array" if error["type"] in ("tuple_type", "list_type") else allowed
            yield dotted(error["loc"]), f"value {value_text(error['input'])}; allowed: {allowed}"


def _count_fault(error: ErrorDetails, allowed: str) -> str:
    return f"value {value_text(error['input'])}; allowed: {allowed.format(**error['ctx'])} entries"


def dotted(loc: Iterable[int | str]) -> str:
    """Return a location in a file as a dotted key: `pdos[1].entries[0].bits`."""
    text = ""
    for part in loc:
        name = brief(str(part))
        text += f"[{part}]" if isinstance(part, int) else f".{name}" if text else name
    return text


def _keys_at(model: type[BaseModel], loc: Iterable[int | str]) -> list[str]:
    """Return the keys that the model has at a place in the file."""
    annotation: Any = model
    for part in loc:
        fields = _fields_by_key(annotation)
        if part in fields:
            annotation = fields[str(part)].annotation
        else:
            annotation = next(
                (a for a in reversed(get_args(annotation)) if a is not Ellipsis), annotation
            )
    return list(_fields_by_key(annotation))


def _fields_by_key(annotation: Any) -> dict[str, FieldInfo]:
    """Return the fields of an annotation's model, by their keys in a file."""
    found = _model_in(annotation)
    fields = found.model_fields if found is not None else {}
    return {field.alias or name: field for name, field in fields.items()}


def _model_in(annotation: Any) -> type[BaseModel] | None:
    """Return the model of an annotation (`M`, `M | None`)."""
    if get_origin(annotation) in (Union, UnionType):
        return next((m for a in get_args(annotation) if (m := _model_in(a))), None)
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return annotation
    return None
