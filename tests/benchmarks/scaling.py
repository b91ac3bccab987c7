"""The results of `bench_scaling.py` as files: rows, a plot, and tables in a page.

Only the text between two marks in the page `scaling.md` is replaced.
"""

import csv
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import NamedTuple

from solver.simulate.settings import SurveySettings
from tests.benchmarks.chart import Panel, draw
from tests.benchmarks.orbits import EXPOSURES_OF_THE_PAPER

BEGIN, END = "<!-- scaling:begin -->", "<!-- scaling:end -->"


class Row(NamedTuple):
    """Results of one size: counts, median times in s, and peak memory in MiB.

    `linearise` is one pass over the measurements and `reduce` the elimination of the sources
    after it; `fit` is a fit with marginal sigmas, starting from the catalogue, and `tables` a fit
    from the input tables to all result tables.
    """

    stars: int
    measurements: int
    sources: int
    exposures: int
    parameters: int
    iterations: int
    unit: float
    prepare: float
    linearise: float
    reduce: float
    fit: float
    what_if: float
    tables: float
    memory: float


class Scaling(NamedTuple):
    """Results of all sizes, and the machine that they were measured on."""

    rows: list[Row]
    machine: str


Columns = Mapping[str, Callable[[Row], str]]

STAGES = {
    "prepare": "preparation",
    "linearise": "one pass",
    "reduce": "elimination",
    "fit": "fit",
    "what_if": "what if",
    "tables": "all tables",
}
KEY: Columns = {
    "measurements": lambda row: f"{row.measurements:,}",
    "exposures": lambda row: str(row.exposures),
}
SIZE: Columns = {
    "sources": lambda row: f"{row.sources:,}",
    "parameters": lambda row: f"{row.parameters:,}",
    "steps": lambda row: str(row.iterations),
    "unit, s": lambda row: _three_digits(row.unit),
    "peak memory, MiB": lambda row: f"{row.memory:,.0f}",
}


def write_all(scaling: Scaling, folder: Path) -> None:
    """Write `scaling.csv` and `scaling.svg`, and the tables into `scaling.md`."""
    folder.mkdir(parents=True, exist_ok=True)
    write_rows(scaling.rows, folder / "scaling.csv")
    # Read back, so that page and plot show the rounded values of the file.
    rows = read_rows(folder / "scaling.csv")
    (folder / "scaling.svg").write_text(plot(rows), encoding="utf-8")
    page = folder / "scaling.md"
    if page.is_file():
        text = page.read_text(encoding="utf-8")
        page.write_text(with_block(text, block(scaling._replace(rows=rows))), encoding="utf-8")


def write_rows(rows: Iterable[Row], path: Path) -> None:
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(Row._fields)
        writer.writerows([f"{value:.6g}" if value % 1 else value for value in row] for row in rows)


def read_rows(path: Path) -> list[Row]:
    with path.open(newline="", encoding="utf-8") as file:
        return [
            Row(*(kind(line[name]) for name, kind in Row.__annotations__.items()))
            for line in csv.DictReader(file)
        ]


def with_block(text: str, content: str) -> str:
    """Return the page with the text between its marks replaced."""
    before, begin, rest = text.partition(BEGIN)
    _, end, after = rest.partition(END)
    if not (begin and end):
        raise ValueError(f"expected the marks {BEGIN} and {END} in the page, found none")
    return f"{before}{BEGIN}\n{content}{END}{after}"


def block(scaling: Scaling) -> str:
    """Return the machine and four tables: sizes, seconds, units, microseconds."""
    tables = {
        "Sizes": SIZE,
        "Seconds": _by_stage(lambda row, seconds: _three_digits(seconds)),
        "Units": _by_stage(lambda row, seconds: f"{seconds / row.unit:.1f}"),
        "Microseconds per measurement": _by_stage(
            lambda row, seconds: f"{1e6 * seconds / row.measurements:.2f}"
        ),
    }
    sections = [f"{title}:\n\n{table(scaling.rows, {**KEY, **c})}" for title, c in tables.items()]
    return "\n".join([f"{scaling.machine}\n", *sections])


def table(rows: Iterable[Row], columns: Columns) -> str:
    """Return a table in Markdown."""
    lines = [list(columns), ["---:"] * len(columns)]
    lines += [[text_of(row) for text_of in columns.values()] for row in rows]
    return "".join(f"| {' | '.join(line)} |\n" for line in lines)


def plot(rows: Iterable[Row]) -> str:
    """Return an SVG chart of the times over measurements and over exposures."""
    stars_of_the_paper, rows = SurveySettings().n_stars, list(rows)
    along_exposures = [row for row in rows if row.stars == stars_of_the_paper]
    along_measurements = [row for row in rows if row.exposures == EXPOSURES_OF_THE_PAPER]
    panels = [
        _panel(f"{EXPOSURES_OF_THE_PAPER} exposures", "measurements", along_measurements),
        _panel(f"{stars_of_the_paper:,} stars in the field", "exposures", along_exposures),
    ]
    return draw([panel for panel in panels if panel.lines["unit"]], "seconds")


def _panel(title: str, axis: str, rows: list[Row]) -> Panel:
    ordered = sorted(rows, key=lambda row: getattr(row, axis))
    lines = {
        label: [(getattr(row, axis), getattr(row, stage)) for row in ordered]
        for stage, label in {"unit": "unit", **STAGES}.items()
    }
    return Panel(title, axis, lines)


def _by_stage(text_of: Callable[[Row, float], str]) -> Columns:
    def column(stage: str) -> Callable[[Row], str]:
        return lambda row: text_of(row, getattr(row, stage))

    return {label: column(stage) for stage, label in STAGES.items()}


def _three_digits(seconds: float) -> str:
    return f"{seconds:.3g}" if seconds < 100.0 else f"{seconds:.0f}"
