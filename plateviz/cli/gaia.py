"""`plateviz gaia`: fetch Gaia stars, the true catalogue of a simulation."""

import time
from pathlib import Path
from typing import Annotated

import typer

from plateviz.cli import options
from solver.data.plural import plural


def gaia(
    output: Annotated[
        Path,
        typer.Argument(
            help="Table for `plateviz simulate --catalog`: .fits, .ecsv, .vot or .parquet.",
            metavar="OUTPUT",
        ),
    ],
    longitude: Annotated[
        tuple[float, float] | None,
        typer.Option(
            "--l",
            help="Galactic longitude range of the field, deg; MIN may be negative. "
            "By default the mini-mock's field.",
            metavar="MIN MAX",
        ),
    ] = None,
    latitude: Annotated[
        tuple[float, float] | None,
        typer.Option(
            "--b",
            help="Galactic latitude range of the field, deg; by default the mini-mock's field.",
            metavar="MIN MAX",
        ),
    ] = None,
    parallax_over_error: Annotated[
        float | None,
        typer.Option(help="Lower limit of parallax over its error; 5 by default.", min=0.0),
    ] = None,
    url: Annotated[
        str | None,
        typer.Option(
            help="Another TAP service to query; it must have the table gaiadr3.gaia_source."
        ),
    ] = None,
    refresh: Annotated[
        bool,
        typer.Option("--refresh", help="Fetch the stars again, even if they are in the cache."),
    ] = False,
    overwrite: options.Overwrite = False,
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON instead of text.")] = False,
) -> None:
    """Fetch stars of Gaia DR3 for a simulation; later calls read them from the cache."""
    from plateviz.cli.gaia_archive import fetch_stars, require_new_table, star_query, write_stars
    from plateviz.cli.output import print_json
    from plateviz.solving.progress import reporting

    start = time.perf_counter()
    require_new_table(output, overwrite)
    chosen = star_query(longitude, latitude, parallax_over_error)
    with reporting("querying the stars"):
        stars = fetch_stars(chosen, url, refresh)
        write_stars(stars.table, output, overwrite)
    meta, seconds = stars.table.meta, time.perf_counter() - start
    if as_json:
        provenance = {key.lower(): str(meta[key]) for key in ("QUERY", "SERVICE", "DATE")}
        print_json(
            {
                "output": str(output),
                "stars": len(stars.table),
                **provenance,
                "from_cache": stars.from_cache,
                "seconds": seconds,
            }
        )
    else:
        fetched = "from the cache" if stars.from_cache else "fetched"
        typer.echo(
            f"{output}: {len(stars.table)} {plural(len(stars.table), 'star')} "
            f"of {meta['SERVICE']}, {fetched}, as of {meta['DATE']}"
        )
