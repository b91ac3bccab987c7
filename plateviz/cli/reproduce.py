"""`plateviz reproduce`: simulate and fit the paper's survey, and print the paper's numbers."""

from pathlib import Path
from typing import Annotated

import typer

from plateviz.runs.run_directory import DEFAULT_RUN


def reproduce(
    directory: Annotated[
        Path | None,
        typer.Argument(
            help="Survey directory; the paper's survey is simulated there if it holds none. "
            "By default a folder of about 5 GB in your cache.",
            metavar="DIR",
        ),
    ] = None,
    run: Annotated[str, typer.Option(help="Name of the run.")] = DEFAULT_RUN,
    workers: Annotated[
        int | None,
        typer.Option(
            help="Number of worker processes on this machine; one per core by default.", min=1
        ),
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON instead of text.")] = False,
) -> None:
    """Print the paper's numbers beside those of a survey of 100 orbits."""
    from plateviz.cache import cache_directory
    from plateviz.cli.output import print_json, print_reproduction
    from plateviz.cli.paper_survey import reproduced

    survey = directory or cache_directory() / "paper-survey"
    table = reproduced(survey, run, workers)
    if as_json:
        rows = table.astype(object).where(table.notna(), None).to_dict("records")
        print_json({"survey": str(survey), "run": run, "rows": rows})
    else:
        print_reproduction(table.to_dict("records"))
