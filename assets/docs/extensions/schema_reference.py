"""Directives that generate the description of the file formats from the code.

| directive            | shows                                                              |
|----------------------|--------------------------------------------------------------------|
| `columns MODULE:NAME`| the columns of a table, `solver.data.schema:MEASUREMENT`           |
| `hdu NAME`           | the columns of an HDU of a result file                             |
| `keywords NAME`      | the header keywords of an HDU                                      |
| `parameters`         | the parameter groups with their priors                             |
| `settings MODULE:NAME`| fields and defaults of a class of settings                        |
| `choices`            | the settings that a fit takes as keywords in a notebook            |
| `fields MODULE:NAME` | plain fields of any class                                          |
| `layout MODULE`      | the tree of files in a module's docstring                          |
| `defects`            | the defects that a simulated survey may have                       |
"""

import dataclasses
import importlib
import inspect
import math
import textwrap
from collections.abc import Callable
from typing import Any, get_origin

from docstrings import attributes
from docutils import nodes
from example_result import example_result
from markup import code, table
from sphinx.application import Sphinx
from sphinx.util.docutils import SphinxDirective

from plateviz.notebook.keywords import KEYWORDS
from solver.data.columns import Column, Table
from solver.data.parameter_group import Axis, Group
from solver.data.parameters import PARAMETERS
from solver.data.prior_text import format_width
from solver.io import header
from solver.io import published_layout as layout
from solver.io.column_check import limits_text
from solver.io.published_layout import PublishedTable, WrittenColumn
from solver.simulate.defects.defect import Defect
from solver.simulate.defects.table import DEFECTS

_AXES: dict[Axis, str] = {
    "src": "source",
    "exp": "exposure",
    "coef": "distortion term",
    "drift": "term and degree in time",
    "breathing": "term, cosine and sine",
    "field": "term and field",
    "own": "term and detector",
    "walk": "term and exposure",
    "det": "detector",
    "motion": "detector and field, or part of it after a move",
}
_DERIVED: dict[str, Callable] = {
    "RESULT": lambda result: layout.source_sigmas(result.sources),
    "TELESCOPE": layout.exposure_columns,
    "DETECTOR": layout.detector_columns,
    "DISTORTION": layout.distortion_columns,
}
_HEADERS = {"PRIMARY": header.primary_header, "RESULT": header.result_header}


def setup(app: Sphinx) -> dict[str, bool]:
    """Register the directives."""
    for name, make in (
        ("columns", columns_of),
        ("hdu", hdu),
        ("keywords", keywords),
        ("parameters", parameters),
        ("settings", settings),
        ("choices", choices),
        ("fields", fields),
        ("layout", files),
        ("defects", defects),
    ):
        app.add_directive(name, _directive(make))
    return {"parallel_read_safe": True, "parallel_write_safe": True}


def _directive(make: Callable[..., nodes.Node]) -> type[SphinxDirective]:
    class Reference(SphinxDirective):
        """Insert the description of what the argument names."""

        optional_arguments = 1

        def run(self) -> list[nodes.Node]:
            """Return it as one node."""
            # The page depends on the code, which Sphinx does not watch.
            self.env.note_reread()
            return [make(*self.arguments)]

    return Reference


def columns_of(where: str) -> nodes.table:
    """Return the columns of a table, with their aliases."""
    found: Table = _named(where)
    rows = (
        (f"`{c.name}`", c.dtype, _unit(c), _meaning(c), code(c.aliases), _absent(c)) for c in found
    )
    return table(("column", "type", "unit", "meaning", "also read as", "where absent"), rows)


def hdu(name: str) -> nodes.table:
    """Return the columns of an HDU in the order in which they are written."""
    kept = next(
        (k for k in vars(layout).values() if isinstance(k, PublishedTable) and k.hdu == name), None
    )
    rows = [] if kept is None else [_kept(kept, column) for column in kept.table]
    rows += [_derived(column) for column in _DERIVED.get(name, lambda _: [])(example_result())]
    if not rows:
        raise ValueError(f"expected an HDU of a result, found {name!r}")
    order = {name: rank for rank, name in enumerate(layout.PUBLISHED_ORDER.get(name, ()))}
    rows.sort(key=lambda row: order.get(row[0].strip("`"), len(order)))
    return table(("column", "unit", "meaning", "in the run directory"), rows)


def keywords(name: str) -> nodes.table:
    """Return the keywords of a header, with the values of the example result."""
    cards = _HEADERS[name](example_result()).cards
    rows = ((f"`{card.keyword}`", str(card.value)[:40], card.comment) for card in cards)
    return table(("keyword", "such as", "meaning"), rows)


def parameters() -> nodes.table:
    """Return the parameter groups."""
    headings = (
        *("group", "symbol", "one per", "unit", "default prior", "its centre"),
        "only with the setting",
    )
    return table(
        headings,
        (
            (
                *(f"`{g.name}`", g.symbol, _AXES[g.axis], _per_unit(g), _prior(g), _centre(g)),
                f"`{g.setting}`" if g.setting else "",
            )
            for g in PARAMETERS
        ),
    )


def settings(where: str) -> nodes.table:
    """Return the fields of a class of settings, with their help or the docstring's meanings."""
    kind = _named(where)
    meanings = {**attributes(kind), **_helps(kind)}
    shown = kind()
    rows = (
        (f"`{f.name}`", _default(getattr(shown, f.name)), meanings.get(f.name, ""))
        for f in dataclasses.fields(kind)
    )
    return table(("setting", "default", "meaning"), rows)


def choices() -> nodes.table:
    """Return the keywords of a fit in a notebook."""
    return table(
        ("keyword", "meaning"), ((f"`{name}`", one.help) for name, one in KEYWORDS.items())
    )


def _helps(kind: type) -> dict[str, str]:
    """Return the help of the fields that have a setting, with the unit."""
    found = {f.name: f.metadata.get("setting") for f in dataclasses.fields(kind)}
    return {
        name: f"{one.help} Unit: {one.unit}." if one.unit else one.help
        for name, one in found.items()
        if one is not None
    }


def fields(where: str) -> nodes.table:
    """Return the fields of a class with plain values, with the meanings in its docstring."""
    kind = _named(where)
    meanings = attributes(kind)
    plain = [f.name for f in dataclasses.fields(kind) if get_origin(f.type) is not tuple]
    return table(("name", "meaning"), ((f"`{name}`", meanings.get(name, "")) for name in plain))


def files(module: str) -> nodes.literal_block:
    """Return the indented part of a module's docstring."""
    text = inspect.getdoc(importlib.import_module(module)) or ""
    tree = textwrap.dedent("\n".join(line for line in text.splitlines() if line.startswith("    ")))
    return nodes.literal_block(tree, tree, language="text")


def defects() -> nodes.table:
    """Return the table of defects."""
    headings = ("defect", "such as", "what it does", "acts on", "stands for", "literature")
    return table(
        headings,
        (
            (
                f"`{d.name}`: {d.label}",
                f"`{d.example}`",
                _does(d),
                d.stage.value,
                d.stands_for,
                d.reference,
            )
            for d in DEFECTS
        ),
    )


def _does(defect: Defect) -> str:
    limits = f"{defect.low:g} to {defect.high:g} {defect.unit}".rstrip()
    return f"{defect.does} Limits: {limits}."


def _default(value: object) -> str:
    # A setting with fields of its own has a table of its own.
    return "" if dataclasses.is_dataclass(value) else f"`{value!r}`"


def _named(where: str) -> Any:  # noqa: ANN401 a table or a class
    module, _, name = where.partition(":")
    return getattr(importlib.import_module(module), name)


def _unit(column: Column) -> str:
    return column.unit and f"`{column.unit}`"


def _meaning(column: Column) -> str:
    limits = [
        *([limits_text(column)] if limits_text(column) else []),
        *(["may be NaN"] if column.may_be_nan else []),
    ]
    return f"{column.meaning} ({', '.join(limits)})" if limits else column.meaning


def _absent(column: Column) -> str:
    if column.required:
        return ""
    return "may be left out" if column.default is None else f"`{column.default}`"


def _kept(kept: PublishedTable, column: Column) -> tuple[str, str, str, str]:
    name = kept.name(column)
    unit = "" if column.name in kept.unitless else _unit(column)
    renamed = f"`{column.name}`" if name != column.name else ""
    return f"`{name}`", unit, _meaning(column), renamed


def _derived(column: WrittenColumn) -> tuple[str, str, str, str]:
    meaning = column.meaning.removeprefix(f"[{column.unit}] ")
    return f"`{column.name}`", column.unit and f"`{column.unit}`", meaning, ""


def _per_unit(group: Group) -> str:
    return f"`{group.unit}`"


def _prior(group: Group) -> str:
    if group.axis == "src":
        return "normal, as wide as the catalogue says"
    if math.isinf(group.width):
        return "flat"
    if group.relative:
        return f"{group.family}, {100.0 * group.width:g} % of its centre"
    return f"{group.family}, {format_width(group.name, group.width)}"


def _centre(group: Group) -> str:
    return f"{group.centre_from}, `{group.column}`" if group.column else group.centre_from
