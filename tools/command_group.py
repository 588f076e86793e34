"""Groups of commands that import the module of a command when it is asked for."""

from __future__ import annotations

import importlib
import inspect
from collections.abc import Mapping
from functools import cache
from typing import Any

import typer
from typer.core import TyperArgument, TyperCommand, TyperGroup
from typing_extensions import override

from cdpr_tools.loading import loading_notice


@cache
def load(module: str, name: str) -> Any:
    """Return the group or command `name` of a module of cdpr_tools.commands: its `app`."""
    with loading_notice():
        app = importlib.import_module(f"cdpr_tools.commands.{module}").app
    group = typer.main.get_group(app)
    command = group if group.name == name else group.commands[name]
    _unwrap(command)
    return command


def _unwrap(command: Any) -> None:
    """Join the lines of each paragraph of the help, which a terminal wraps by its own width.

    Arguments that have no word of their own are called by their names, as capitals.
    """
    for param in command.params:
        if isinstance(param, TyperArgument):
            param.metavar = param.metavar or str(param.name).upper()
    paragraphs = inspect.cleandoc(command.help or "").split("\n\n")
    command.help = "\n\n".join(paragraph.replace("\n", " ") for paragraph in paragraphs)
    for other in getattr(command, "commands", {}).values():
        _unwrap(other)


def group_of(modules: Mapping[str, Mapping[str, str]]) -> type[TyperGroup]:
    """Return the class of a group of commands.

    `modules` has for each module of cdpr_tools.commands the names and first lines of its commands.
    The group's own help shows these lines and imports none of the modules: each brings libraries
    along.
    """
    module_of = {name: module for module, lines in modules.items() for name in lines}

    class _Group(TyperGroup):
        def __init__(self, **settings: Any) -> None:
            super().__init__(**settings)
            for lines in modules.values():
                for name, line in lines.items():
                    self.add_command(TyperCommand(name, help=line))

        @override
        def resolve_command(self, ctx: Any, args: list[str]) -> Any:
            if (name := args[0]) in module_of:
                self.add_command(load(module_of[name], name))
            return super().resolve_command(ctx, args)

    return _Group


def lazy_group(name: str, line: str, modules: Mapping[str, Mapping[str, str]]) -> typer.Typer:
    """Return the group `name` of such commands; `line` is what its help says of it."""
    app = typer.Typer(name=name, cls=group_of(modules), help=line, no_args_is_help=True)

    @app.callback()
    def group() -> None:
        """Have typer make a group where it knows of no command."""

    return app
