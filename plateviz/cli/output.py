"""What the command line prints: progress on standard error, results on standard output."""

import json
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer
from rich import box
from rich.console import Console
from rich.table import Table

from solver.data.plural import plural
from solver.data.settings import COUNTED
from solver.units import MPIX_PER_PIX

if TYPE_CHECKING:
    from solver.results.agreement import Agreement


@contextmanager
def telling_if_interrupted(words: str) -> Iterator[None]:
    """Print what Ctrl-C in the block leaves behind, and what to do next."""
    try:
        yield
    except KeyboardInterrupt:
        typer.echo(f"plateviz: interrupted; {words}", err=True)
        raise


def print_json(value: object) -> None:
    """Print one JSON value."""
    typer.echo(json.dumps(value, indent=1, allow_nan=False, default=str))


def print_fit(summary: Mapping[str, Any], output: Path) -> None:
    """Print the summary of a fit as text."""
    outcome = "converged" if summary["converged"] else "NOT CONVERGED"
    rows = [
        ("orbit", f"{summary['orbit']}, mean epoch MJD {summary['epoch_mjd']:.5f} (TCB)"),
        (
            "data",
            f"{_counted(summary, 'measurement')} of {_counted(summary, 'source')} "
            f"({summary['n_reference']} reference) on {_counted(summary, 'exposure')}",
        ),
        *_outlier_row(summary),
        ("engine", _engine(summary)),
        ("fit", f"{outcome}: {summary['reason']}"),
        ("chi2 per degree of freedom", _chi2(summary)),
        ("residual rms", _milli_pixels(summary)),
        ("normalised deviation", _deviations(summary)),
        *_common_error_row(summary),
        *_truth_rows(summary.get("truth", {})),
        ("time", ", ".join(f"{k} {v:.2f} s" for k, v in summary["seconds"].items())),
        ("written", str(output)),
        ("verdict", summary["verdict"]["headline"]),
    ]
    width = max(len(name) for name, _ in rows)
    for name, text in rows:
        typer.echo(f"{name:<{width}}  {text}")
    verdict = summary["verdict"]
    # Those of a good solution, too: they say what no test of it can see.
    for sentence in [*verdict["reasons"], *verdict["notable"]]:
        typer.echo(f"- {sentence}")


def _common_error_row(summary: Mapping[str, Any]) -> list[tuple[str, str]]:
    if summary["n_reference"] == summary["n_sources"]:
        return []
    words = "mas, of the mean of all non-reference sources"
    return [("common error", _pair(summary, "mean_error_{}", words))]


def print_orders(rows: Iterable[Mapping[str, Any]], verdict: str) -> None:
    """Print the comparison of orders, rows of `tables.order_comparison`, as a table."""
    table = Table(box=box.SIMPLE_HEAD, pad_edge=False)
    for title in _ORDER_TITLES:
        table.add_column(title, justify="right")
    for row in rows:
        spread = row["held_out_sd"]
        table.add_row(
            f"{row['order']}{' *' if row['is_fitted'] else ''}",
            str(row["n_terms"]),
            _number(row["chi2_per_dof"], ".4f"),
            _number(row["evidence_below_best"], ",.1f"),
            _number(row["held_out_chi2_per_dof"], ".4f") + _number(spread, " ± .4f"),
            _number(row["log_density_below_best"], ",.1f"),
        )
    Console(highlight=False).print(table)
    typer.echo(f"* fitted. {verdict}")


def print_reproduction(rows: Iterable[Mapping[str, Any]]) -> None:
    """Print the paper's numbers beside ours, rows of `tables.reproduction`, as a table."""
    table = Table(box=box.SIMPLE_HEAD, pad_edge=False)
    table.add_column("quantity, and how it is read")
    for title in ("paper", "here", "unit", "ratio"):
        table.add_column(title, justify="left" if title == "unit" else "right", no_wrap=True)
    for row in rows:
        low, high = row["paper_low"], row["paper_high"]
        paper = f"{low:.3g}" if low == high else f"{low:.3g} to {high:.3g}"
        quantity = f"{row['quantity']}\n  [dim]{row['reading']}[/dim]"
        table.add_row(quantity, paper, f"{row['ours']:.3g}", row["unit"], f"{row['ratio']:.2g}")
    Console(highlight=False).print(table)


_ORDER_TITLES = (
    "order",
    "terms",
    "chi2/dof",
    "log evidence\nbelow best",
    "held-out\nchi2/dof",
    "log density\nbelow best",
)


def _number(value: float | None, form: str) -> str:
    """Return a formatted number, or a dash for None; `form` may have a prefix before a space."""
    prefix, _, form = form.rpartition(" ")
    return "-" if value is None else f"{prefix} {value:{form}}" if prefix else f"{value:{form}}"


def print_agreement(rows: Iterable["Agreement"]) -> None:
    """Print the comparison of the engines, one line per number."""
    for row in rows:
        verdict = "agrees" if row.agrees else "DOES NOT AGREE"
        typer.echo(f"{row.engine}: {row.what}: {row.found:.3g} (limit {row.limit:.3g}), {verdict}")


def _counted(summary: Mapping[str, Any], noun: str) -> str:
    number = summary[f"n_{noun}s"]
    return f"{number} {plural(number, noun)}"


def print_inspection(reports: list[dict[str, Any]]) -> None:
    """Print the reports of `inspect_files` as text."""
    for report in reports:
        typer.echo(f"{report['file']}: {report['kind']}")
        for table in report["tables"]:
            typer.echo(f"  {table['name']}: {table['rows']} {plural(table['rows'], 'row')}")
            for column in table["columns"]:
                typer.echo(f"    {_column(column)}")
        for line in _survey_lines(report):
            typer.echo(f"  {line}")
        for defect in report["defects"]:
            typer.echo(f"  simulated with the defect {defect}")
        for problem in report["problems"]:
            typer.echo(f"  WRONG: {problem}")


def _survey_lines(report: Mapping[str, Any]) -> Iterator[str]:
    """Yield how many orbits and measurements a survey has, and orbits each of its runs."""
    for what, number in report["counts"].items():
        yield f"{what}: {number:,}"
    for run in report.get("runs", []):
        yield f"orbits solved in the run {run['name']}: {run['orbits']:,}"


def _column(column: Mapping[str, Any]) -> str:
    meaning = column.get("canonical") or "not read"
    values = f"{column['min']} to {column['max']}" if column.get("min") is not None else ""
    unit = f" {column['unit']}" if column.get("unit") else ""
    is_date = meaning == "obstime" and unit == " d" and values
    dates = _dates(column) if is_date else ""
    return f"{column['name']:<18} {column['type']:<8} {values}{unit}{dates}  ({meaning})"


def _dates(column: Mapping[str, Any]) -> str:
    """Return the first and last of a column of modified Julian dates; empty if one is no date."""
    import pandas as pd

    from plateviz.tables.labels import dates

    first, last = dates(pd.Series([column["min"], column["max"]], dtype=float))
    return f", {first} to {last} TCB" if first and last else ""


def _outlier_row(summary: Mapping[str, Any]) -> list[tuple[str, str]]:
    if "n_outliers" not in summary:
        return []
    return [("outliers", f"{summary['n_outliers']} excluded; listed in the result")]


def _engine(summary: Mapping[str, Any]) -> str:
    if summary["engine"] == "nuts" and "samples" in summary:
        return (
            f"nuts, {summary['samples']} samples of {summary['chains']} chains, "
            f"{summary['divergences']} divergent steps, R-hat at most "
            f"{summary['largest_r_hat']:.3f}, at least "
            f"{summary['smallest_effective_samples']:.0f} effective samples "
            f"(by {summary['mixing_by']})"
        )
    return f"{summary['engine']}, {summary['iterations']} {COUNTED[summary['engine']]}s"


def _chi2(summary: Mapping[str, Any]) -> str:
    expected = (2.0 / summary["dof"]) ** 0.5
    return (
        f"{summary['chi2_per_dof']:.4f} (expected 1 ± {expected:.4f}; "
        f"{summary['effective_parameters']:.0f} effective of {summary['n_parameters']} parameters)"
    )


def _milli_pixels(summary: Mapping[str, Any]) -> str:
    x, y = (MPIX_PER_PIX * summary[f"residual_rms_{axis}"] for axis in "xy")
    return f"{x:.2f}, {y:.2f} mpix in x, y"


def _deviations(summary: Mapping[str, Any]) -> str:
    measured, expected = (
        ", ".join(f"{summary[f'{kind}normalised_deviation_{axis}']:.3f}" for axis in ("ra", "dec"))
        for kind in ("", "expected_")
    )
    return f"{measured} in RA, Dec of the reference sources (expected {expected})"


def _pair(summary: Mapping[str, Any], pattern: str, unit: str) -> str:
    ra, dec = (summary[pattern.format(axis)] for axis in ("ra", "dec"))
    return f"{ra:.3f}, {dec:.3f} {unit}"


def _truth_rows(truth: Mapping[str, Mapping[str, Any]]) -> list[tuple[str, str]]:
    return [
        (
            f"{name} against truth",
            f"{numbers['n']} {plural(numbers['n'], 'source')}: "
            f"mean {_pair(numbers, 'mean_{}', 'mas')} "
            f"(of which {_pair(numbers, 'induced_{}', '')}from the reference sources), "
            f"rms {_pair(numbers, 'rms_{}', 'mas')}, rms pull {_pair(numbers, 'pull_rms_{}', '')}",
        )
        for name, numbers in truth.items()
    ]
