"""`plateviz inspect`: describe files, and check them and the runs of a survey against damage."""

from pathlib import Path
from typing import Annotated

import typer


def inspect(
    files: Annotated[
        list[Path],
        typer.Argument(
            help="Files, folders of an orbit, or survey directories to inspect.", metavar="FILE..."
        ),
    ],
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON instead of text.")] = False,
) -> None:
    """Describe files and their columns, and list every problem found in them.

    Of a survey, every file of it and of its runs is compared with its SHA-256.
    """
    from plateviz.cli.output import print_inspection, print_json
    from plateviz.runs.changed_inputs import changed_inputs
    from plateviz.runs.run_directory import run_directories
    from solver.io.inspect import inspect_files

    found = inspect_files(files)
    for path, one in zip(files, found, strict=True):
        if one["kind"] == "survey":
            one["runs"] = []
            for run in run_directories(path):
                one["problems"] += [*run.changes(), *changed_inputs(run).values()]
                one["runs"].append({"name": run.name, "orbits": len(run.complete_orbits())})
    if as_json:
        print_json(found)
    else:
        print_inspection(found)
    if any(one["problems"] for one in found):
        raise typer.Exit(2)
