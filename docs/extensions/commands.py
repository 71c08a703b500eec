"""The directive ``.. commands:: MODULE:APP``: a reference of the commands of a typer program."""

from __future__ import annotations

import inspect
from importlib import import_module
from typing import TYPE_CHECKING, Any

import typer
from docutils import nodes
from docutils.statemachine import StringList
from sphinx.util.docutils import SphinxDirective

if TYPE_CHECKING:
    from collections.abc import Iterator

    from sphinx.application import Sphinx


def entries(command: Any, name: str) -> Iterator[tuple[str, Any]]:
    """Yield all commands below a command with their full names."""
    if hasattr(command, "commands"):
        for each, below in command.commands.items():
            yield from entries(below, f"{name} {each}")
    else:
        yield name, command


def usage(name: str, command: Any) -> str:
    """Return the usage line of a command."""
    arguments = [each for each in command.params if each.param_type_name == "argument"]
    texts = [called(each) if each.required else f"[{called(each)}]" for each in arguments]
    return " ".join([name, *texts, "[OPTIONS]"])


def called(argument: Any) -> str:
    """Return the displayed name of an argument."""
    return str(argument.metavar or argument.name.upper())


def described(command: Any) -> Iterator[str]:
    """Yield a definition list entry for each option and argument."""
    for each in command.params:
        if getattr(each, "hidden", False) or each.name == "help":
            continue
        names = [*each.opts, *each.secondary_opts]
        if each.param_type_name == "argument":
            names = [called(each)]
        text = " ".join((getattr(each, "help", None) or "").split()).replace("*", r"\*")
        yield f"{', '.join(f'``{name}``' for name in names)}\n    {text or '-'}\n"


class Commands(SphinxDirective):
    """A directive that adds a section for each command."""

    required_arguments = 1

    def run(self) -> list[nodes.Node]:
        """Return the sections."""
        module, _, attribute = self.arguments[0].partition(":")
        import_module(module).register_commands()
        program = typer.main.get_command(getattr(import_module(module), attribute))
        found: list[nodes.Node] = []
        for name, command in sorted(entries(program, "bellcrank")):
            section = nodes.section(ids=[name.replace(" ", "-")])
            section += nodes.title(text=name.removeprefix("bellcrank "))
            text = inspect.cleandoc(command.help or "").replace("\b", "").split("\f")[0]
            lines = [
                ".. code-block:: text", "", f"    {usage(name, command)}", "",
                *text.splitlines(), "", *"\n".join(described(command)).splitlines(),
            ]  # fmt: skip
            self.state.nested_parse(StringList(lines, name), 0, section)
            found.append(section)
        return found


def setup(app: Sphinx) -> dict[str, bool]:
    """Register the directive."""
    app.add_directive("commands", Commands)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
