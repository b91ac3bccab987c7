"""Convert the docstrings to reStructuredText: `name : meaning` gives a meaning, not a type."""

import inspect
import re
from collections.abc import Callable, Iterator

from sphinx.application import Sphinx

_FIELDS: dict[str, Callable[[str, str], list[str]]] = {
    "Parameters": lambda name, text: [f":param {one}: {text}" for one in name.split(", ")],
    "Attributes": lambda name, text: [f"* :py:obj:`{name}`: {text}"],
    "Raises": lambda name, text: [f":raises {name}: {text}"],
}
_PROSE = {"Returns": ":returns: ", "Yields": ":yields: "}
_ENTRY = re.compile(r"(?P<name>[\w*, .]+?)(?: : (?P<text>.*))?$")


def setup(app: Sphinx) -> dict[str, bool]:
    """Register the conversion."""
    app.connect("autodoc-process-docstring", _process)
    return {"parallel_read_safe": True, "parallel_write_safe": True}


def attributes(kind: type) -> dict[str, str]:
    """Return the meaning of each attribute in a class's docstring."""
    found = {}
    for title, lines in _sections(inspect.getdoc(kind) or ""):
        if title == "Attributes":
            for names, text in _entries(lines):
                found |= dict.fromkeys(names.split(", "), text)
    return found


def converted(text: str) -> list[str]:
    """Return a docstring as lines of reStructuredText."""
    lines: list[str] = []
    for title, body in _sections(text):
        if title in _PROSE:
            lines += ["", _PROSE[title] + " ".join(map(_plain, filter(None, body)))]
        elif title in _FIELDS:
            lines += ["", *([".. rubric:: Attributes", ""] if title == "Attributes" else [])]
            for name, meaning in _entries(body):
                lines += _FIELDS[title](name, _plain(meaning))
        else:
            lines += map(_plain, body)
    return [*lines, ""]


def _process(_: Sphinx, __: str, ___: str, ____: object, _____: object, lines: list[str]) -> None:
    lines[:] = converted("\n".join(lines))


def _sections(text: str) -> Iterator[tuple[str, list[str]]]:
    """Yield title and lines of each section; the first has no title."""
    title, body = "", []
    for line in text.splitlines():
        if body and re.fullmatch(r"-{3,}", line) and len(line) == len(body[-1]):
            yield title, body[:-1]
            title, body = body[-1], []
        else:
            body.append(line)
    yield title, body


def _entries(lines: list[str]) -> Iterator[tuple[str, str]]:
    """Yield the name and the meaning of each entry of a section."""
    name, words = "", []
    for line in lines:
        begins = re.match(r"\S", line) and _ENTRY.fullmatch(line)
        if begins:
            if name:
                yield name, " ".join(words)
            name, words = begins["name"], [begins["text"]] if begins["text"] else []
        elif line.strip():
            words.append(line.strip())
    if name:
        yield name, " ".join(words)


def _plain(line: str) -> str:
    """Escape markup outside backticks."""
    parts = line.split("`")
    parts[::2] = [re.sub(r"([*_|\\])", r"\\\1", part) for part in parts[::2]]
    return "`".join(parts)
