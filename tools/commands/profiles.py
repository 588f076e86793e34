"""`cdpr profiles`: list and show profiles of motors, drives, cables, winches and robots."""

from __future__ import annotations

import dataclasses
import itertools
from typing import Annotated, Any

import typer
from pydantic import BaseModel

import cdpr_profiles as catalogue
from cdpr_profiles import RobotAxis
from cdpr_profiles.catalogue import load_profile
from cdpr_profiles.reader import closest
from cdpr_tools.commands.options import JsonOption, argument
from cdpr_tools.errors import BadInputError
from cdpr_tools.output import Output

app = typer.Typer(
    name="profiles",
    help="List and show the profiles of motors, drives, cables, winches and robots.",
    no_args_is_help=True,
)


@app.command("list")
def list_(
    kind: Annotated[
        str | None, argument("List only this kind: robots, winches, ...", metavar="[KIND]")
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """List the profiles by kind: shipped ones, and your own."""
    out = Output(as_json)
    names = catalogue.list_profiles()
    if kind is not None:
        if kind not in names:
            raise BadInputError(f"{kind}: allowed: {', '.join(names)}")
        names = {kind: names[kind]}
    for shown, of_kind in names.items():
        out.say(f"{shown}:")
        out.say("  " + ", ".join(of_kind))
    out.result({"ok": True} | dict(names.items()))


@app.command()
def show(
    name: Annotated[str, argument("A name from `cdpr profiles list`.")],
    as_json: JsonOption = False,
) -> None:
    """Show all values of a profile."""
    out = Output(as_json)
    kinds = [kind for kind, names in catalogue.list_profiles().items() if name in names]
    if not kinds:
        names = itertools.chain(*catalogue.list_profiles().values())
        meant = closest(name, names)
        hint = f"did you mean {meant!r}?" if meant else "`cdpr profiles list` shows all profiles"
        raise BadInputError(f"profile {name!r}: does not exist; {hint}")
    content = _plain(load_profile(kinds[0], name))
    out.say(f"{kinds[0]}: {name}")
    for key, value in _flat(content):
        out.say(f"  {key} = {value}")
    out.result({"ok": True, "kind": kinds[0], "profile": content})


def _plain(profile: object) -> dict[str, Any]:
    if isinstance(profile, BaseModel):
        return profile.model_dump(mode="json")
    assert dataclasses.is_dataclass(profile)  # the catalogue has no other types
    values = {f.name: getattr(profile, f.name) for f in dataclasses.fields(profile)}
    if isinstance(profile, RobotAxis):
        values["winch"] = profile.winch.reference  # `cdpr profiles show` shows it separately
    return {key: _plain_value(value) for key, value in values.items()}


def _plain_value(value: object) -> object:
    if isinstance(value, tuple):
        return [_plain_value(v) for v in value]
    if isinstance(value, BaseModel) or dataclasses.is_dataclass(value):
        return _plain(value)
    return value


def _flat(table: dict[str, Any], prefix: str = "") -> list[tuple[str, Any]]:
    rows: list[tuple[str, Any]] = []
    for key, value in table.items():
        if isinstance(value, dict):
            rows += _flat(value, f"{prefix}{key}.")
        elif isinstance(value, list | tuple) and value and isinstance(value[0], str):
            rows += [(f"{prefix}{key}", text) for text in value]
        elif isinstance(value, list | tuple) and value and isinstance(value[0], dict):
            for i, one in enumerate(value):
                rows += _flat(one, f"{prefix}{key}[{i}].")
        else:
            rows.append((prefix + key, value))
    return rows
