"""The directive `command`: a reference of one command, generated from the command itself."""

import inspect
from collections.abc import Iterator
from pathlib import Path
from types import NoneType
from typing import Any, NamedTuple, get_args, get_origin, get_type_hints

from docutils import nodes
from markup import code, table, words
from sphinx.application import Sphinx
from sphinx.util.docutils import SphinxDirective
from typer.main import get_command

from plateviz.cli.main import app

COMMANDS: dict[str, Any] = get_command(app).commands  # type: ignore[attr-defined]
_VALUES = {int: "NUMBER", float: "NUMBER", str: "TEXT", Path: "FILE", bool: ""}


def setup(site: Sphinx) -> dict[str, bool]:
    """Register the directive."""
    site.add_directive("command", CommandReference)
    return {"parallel_read_safe": True, "parallel_write_safe": True}


class Parameter(NamedTuple):
    """An argument or an option of a command, with its help text."""

    names: list[str]
    value: str
    default: object
    is_argument: bool
    is_required: bool
    help: str


class CommandReference(SphinxDirective):
    """Describe the command that its argument names."""

    required_arguments = 1

    def run(self) -> list[nodes.Node]:
        """Return its summary, usage, arguments and options."""
        # The page depends on the code, which Sphinx does not watch.
        self.env.note_reread()
        name = self.arguments[0]
        if name not in COMMANDS:
            raise self.error(f"expected a command out of {', '.join(COMMANDS)}")
        takes = list(parameters(name))
        usage = " ".join(["plateviz", name, *_usage(takes), "[OPTIONS]"])
        does = inspect.getdoc(COMMANDS[name].callback) or ""
        rows = [(code(one.names), one.value, _default(one), one.help) for one in takes]
        return [
            nodes.paragraph("", "", *words(does)),
            nodes.literal_block(usage, usage, language="text"),
            table(("", "value", "default", "meaning"), rows),
        ]


def parameters(name: str) -> Iterator[Parameter]:
    """Yield the parameters of a command in order; KeyError if there is no such command."""
    called: Any = COMMANDS[name]
    hints = get_type_hints(called.callback, include_extras=True)
    for one in called.params:
        is_argument = one.param_type_name == "argument"
        kind = get_args(hints[one.name])[0]
        names = [one.metavar] if is_argument else [*one.opts, *one.secondary_opts]
        value = "" if is_argument else one.metavar or _VALUES[_plain(kind)]
        yield Parameter(names, value, one.default, is_argument, one.required, one.help or "")


def _plain(kind: Any) -> Any:  # noqa: ANN401 any type that a parameter can have
    """Return the type of one value: of `list[str] | None`, str."""
    inner = [one for one in get_args(kind) if one is not NoneType]
    return _plain(inner[0]) if inner and get_origin(kind) is not None else kind


def _usage(takes: list[Parameter]) -> Iterator[str]:
    for one in takes:
        if one.is_argument:
            yield one.names[0] if one.is_required else f"[{one.names[0]}]"
        elif one.is_required:
            yield f"{one.names[-1]} {one.value}"


def _default(one: Parameter) -> str:
    if one.is_required:
        return "required"
    if one.default is None or one.default == "" or one.default is False:
        return ""
    return code([one.names[0] if one.default is True else str(one.default)])
