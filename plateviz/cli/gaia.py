"""`plateviz gaia`: fetch the stars of Gaia from which `plateviz simulate` makes a survey."""

import time
from pathlib import Path
from typing import Annotated

import typer


def gaia(
    output: Annotated[
        Path,
        typer.Argument(
            help="Table to write: .fits, .ecsv, .vot or .parquet; "
            "`plateviz simulate --catalog` takes it.",
            metavar="OUTPUT",
        ),
    ],
    longitude: Annotated[
        tuple[float, float] | None,
        typer.Option(
            "--l",
            help="Galactic longitudes of another field than the mini-mock's, deg; "
            "the first may be negative.",
            metavar="MIN MAX",
        ),
    ] = None,
    latitude: Annotated[
        tuple[float, float] | None,
        typer.Option("--b", help="Galactic latitudes, likewise.", metavar="MIN MAX"),
    ] = None,
    parallax_over_error: Annotated[
        float | None,
        typer.Option(help="What parallaxes exceed, in their errors; 5 by default.", min=0.0),
    ] = None,
    url: Annotated[
        str | None,
        typer.Option(help="Another TAP service with the table gaiadr3.gaia_source."),
    ] = None,
    refresh: Annotated[
        bool, typer.Option("--refresh", help="Fetch again what is in the cache.")
    ] = False,
    as_json: Annotated[bool, typer.Option("--json", help="Print one JSON value.")] = False,
) -> None:
    """Fetch stars of Gaia DR3 to simulate with; a second time they come from the cache."""
    from plateviz.cli.output import print_json
    from plateviz.gaia.archive import fetch_stars, require_format, star_query, write_stars
    from plateviz.solving.progress import reporting

    start = time.perf_counter()
    require_format(output)
    chosen = star_query(longitude, latitude, parallax_over_error)
    with reporting("asking for the stars"):
        stars = fetch_stars(chosen, url, refresh)
        write_stars(stars.table, output)
    meta, seconds = stars.table.meta, time.perf_counter() - start
    if as_json:
        told = {key.lower(): str(meta[key]) for key in ("QUERY", "SERVICE", "DATE")}
        source = {"from_cache": stars.from_cache, "seconds": seconds}
        print_json({"output": str(output), "stars": len(stars.table), **told, **source})
    else:
        origin = "from the cache" if stars.from_cache else "fetched"
        typer.echo(
            f"{output}: {len(stars.table)} stars of {meta['SERVICE']}, {origin}, "
            f"as of {meta['DATE']}"
        )
