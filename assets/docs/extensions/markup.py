"""Nodes of a page for the extensions: tables, and text with code in backticks."""

from collections.abc import Iterable, Sequence

from docutils import nodes


def words(text: str) -> list[nodes.Node]:
    """Return a text as nodes; parts in backticks become code."""
    parts = text.split("`")
    kinds = (nodes.Text, lambda part: nodes.literal("", part))
    return [kinds[number % 2](part) for number, part in enumerate(parts) if part]


def code(names: Iterable[str]) -> str:
    """Return names in backticks, separated by commas."""
    return ", ".join(f"`{name}`" for name in names)


def table(headings: Sequence[str], rows: Iterable[Sequence[str]]) -> nodes.table:
    """Return a table of texts in the form of `words`; empty columns are omitted."""
    kept = list(rows)
    used = [i for i in range(len(headings)) if any(row[i] for row in kept)]
    group = nodes.tgroup(cols=len(used))
    group += [nodes.colspec(colwidth=1) for _ in used]
    group += nodes.thead("", _row([headings[i] for i in used]))
    group += nodes.tbody("", *(_row([row[i] for i in used]) for row in kept))
    return nodes.table("", group, classes=["colwidths-auto"])


def _row(cells: Iterable[str]) -> nodes.row:
    return nodes.row("", *(nodes.entry("", nodes.paragraph("", "", *words(c))) for c in cells))
