"""Groups of commands that import the module of a command on first use."""

from __future__ import annotations

import importlib
import inspect
import os
from collections.abc import Mapping, Sequence
from difflib import get_close_matches
from functools import cache
from typing import Any

import typer
from typer.core import TyperCommand, TyperGroup
from typing_extensions import override

from cdpr_tools.errors import BadInputError
from cdpr_tools.loading import without_collection

ROBOT_VARIABLE = "CDPR_ROBOT"
"""Environment variable that names the robot if the command line names none."""
HARMLESS = frozenset({"Look", "Describe", "Simulate", "Machine"})
"""Headings of commands that neither move anything nor switch power."""


@cache
def load(module: str, name: str) -> Any:
    """Return the group or command `name` of a module of cdpr_tools.commands: its `app`."""
    with without_collection():
        app = importlib.import_module(f"cdpr_tools.commands.{module}").app
    group = typer.main.get_group(app)
    command = group if group.name == name else group.commands[name]
    _unwrap(command)
    return command


def _unwrap(command: Any) -> None:
    """Prepare a command's help: paragraphs without line ends, so that a terminal can wrap them.

    Arguments without a metavariable are shown by their names, in capitals.
    """
    for param in command.get_params(typer.Context(command)):
        _shorten(param)
    paragraphs = inspect.cleandoc(command.help or "").split("\n\n")
    command.help = "\n\n".join(paragraph.replace("\n", " ") for paragraph in paragraphs)
    _accept_robot_option(command)
    for other in getattr(command, "commands", {}).values():
        _unwrap(other)


def _accept_robot_option(command: Any) -> None:
    """Accept `--robot ROBOT` as the first argument of a command if that argument is a robot.

    If the user omits the robot and the next argument is a choice, ROBOT_VARIABLE names the robot.
    In other commands, the argument itself reads the variable.
    """
    arguments = [param for param in command.params if param.param_type_name == "argument"]
    is_option = any("--robot" in param.opts for param in command.params)
    if is_option or not arguments or "ROBOT" not in arguments[0].metavar.strip("[]").split("|"):
        return
    parse = command.parse_args
    choices = arguments[1].type_descriptor.choices or () if len(arguments) > 1 else ()

    def parse_args(ctx: Any, args: list[str]) -> Any:
        robot, args = _robot_option(args)
        usual = os.environ.get(ROBOT_VARIABLE)
        if robot is None and usual and choices:
            typed, _, _ = command.make_parser(ctx).parse_args(list(args))
            if typed.get(arguments[0].name) in [one.value for one in choices]:
                robot = usual
        return parse(ctx, args if robot is None else [robot, *args])

    command.parse_args = parse_args


def _robot_option(args: Sequence[str]) -> tuple[str | None, list[str]]:
    """Return the value of `--robot` and the other words; None if it is not given."""
    words = iter(args)
    robot, others = None, []
    for word in words:
        if word == "--robot":
            robot = next(words, "")
        elif word.startswith("--robot="):
            robot = word.partition("=")[2]
        else:
            others.append(word)
        if robot is not None and (not robot or robot.startswith("-")):
            raise BadInputError("--robot: give the name or the file of a robot after it")
        if word == "--":
            break
    return robot, [*others, *words]


def _no_type(ctx: Any) -> None:
    """Return no type for an argument in the help, because its name says enough."""
    del ctx


def _shorten(param: Any) -> None:
    """Show at most one word for the kind of a value; show its range in the explanation."""
    kind = param.type_descriptor
    if param.param_type_name == "argument":
        param.metavar = param.metavar or str(param.name).upper()
        param.display_type_rich = _no_type
        choices = [one.value for one in kind.choices or ()]
        if not all(one in param.help for one in choices):
            param.help = f"{param.help} ({', '.join(choices)})"
    elif param.is_flag:
        param.metavar = ""
    elif param.metavar is None and not kind.is_choice:
        number = kind.is_ranged or kind.annotation in (int, float)
        param.metavar = "PATH" if kind.is_path else "N" if number else "TEXT"
    low, high = param.min, param.max
    if low is not None or high is not None:
        bounds = f"{low:g} or more" if high is None else f"{low:g} to {high:g}"
        param.help = f"{param.help} ({bounds})"
        param.min = param.max = None


def group_of(
    modules: Mapping[str, Mapping[str, str]],
    panels: Mapping[str, Sequence[str]] | None = None,
    epilogs: Mapping[str, str] | None = None,
) -> type[TyperGroup]:
    """Return the class of a group of commands.

    `modules` has, for each module of cdpr_tools.commands, the names and first lines of its
    commands. The group's own help shows these lines without importing the modules' libraries.
    With `panels` the help sorts the commands under headings and hides those that have none.
    `epilogs` end the help of commands. For a mistyped name, only commands under a heading of
    `HARMLESS` are suggested, never one that moves or cuts power.
    """
    module_of = {name: module for module, lines in modules.items() for name in lines}
    names = [name for some in panels.values() for name in some] if panels else list(module_of)
    hidden = [name for name in module_of if name not in names]
    panel_of = {name: panel for panel, some in (panels or {}).items() for name in some}
    suggested = [name for name in names if panel_of.get(name) in HARMLESS]
    line_of = {name: line for lines in modules.values() for name, line in lines.items()}

    class _Group(TyperGroup):
        def __init__(self, **settings: Any) -> None:
            super().__init__(**{**settings, "suggest_commands": False})
            for name in (*names, *hidden):
                self.add_command(
                    TyperCommand(
                        name,
                        help=line_of[name],
                        rich_help_panel=panel_of.get(name),
                        hidden=name in hidden,
                    )
                )

        @override
        def get_params(self, ctx: Any) -> list[Any]:
            params = super().get_params(ctx)
            for param in params:
                _shorten(param)
            return params

        @override
        def list_commands(self, ctx: Any) -> list[str]:
            return [*names, *hidden]  # in the order of the help, not alphabetical

        @override
        def resolve_command(self, ctx: Any, args: list[str]) -> Any:
            name = args[0]
            if name in module_of:
                command = load(module_of[name], name)
                command.epilog = (epilogs or {}).get(name)
                self.add_command(command)
            elif not ctx.resilient_parsing and not name.startswith("-"):
                near = " or ".join(map(repr, get_close_matches(name, suggested)))
                ctx.fail(f"No such command '{name}'" + (near and f"; did you mean {near}?"))
            return super().resolve_command(ctx, args)

    return _Group


def lazy_group(name: str, line: str, modules: Mapping[str, Mapping[str, str]]) -> typer.Typer:
    """Return the group `name` of such commands; `line` is its text in the help."""
    app = typer.Typer(name=name, cls=group_of(modules), help=line, no_args_is_help=True)

    @app.callback()
    def group() -> None:
        """Make typer create a group although it has no command yet."""

    return app
