"""Options of the command line that say how orbits are fitted, and the settings they make."""

from pathlib import Path
from typing import Annotated

import typer

from solver.data.exclusions import parse_exclusions
from solver.data.parameters import PARAMETERS
from solver.data.prior_text import parse_shift, parse_width
from solver.data.settings import FitSettings
from solver.errors import InputError

_GROUPS = ", ".join(group.name for group in PARAMETERS)

Order = Annotated[int, typer.Option(help="Order of the distortion, 0 to 9.")]
Prior = Annotated[
    list[str] | None,
    typer.Option(
        help="Prior width of a parameter group, such as distortion_x=0.5um or "
        f"position_angle=flat; may be repeated. Groups: {_GROUPS}.",
        metavar="GROUP=VALUE",
    ),
]
Centre = Annotated[
    list[str] | None,
    typer.Option(
        help="Shift the centre of a prior from the value in the files, such as "
        "focal_length=100um or detector_x[2]=-5um; may be repeated. An element is "
        "FIELD/PLATE, a detector, K/L of a distortion term, or ra or dec of sources.",
        metavar="GROUP[ELEMENT]=SHIFT",
    ),
]
Exclude = Annotated[
    list[str] | None,
    typer.Option(
        help="Leave out measurements: source=ID, exposure=FIELD/PLATE or detector=ID; "
        "may be repeated.",
        metavar="WHAT",
    ),
]
Aberration = Annotated[bool, typer.Option(help="Model the aberration by the observer's velocity.")]
Robust = Annotated[
    bool, typer.Option("--robust", help="Look for outliers, list them and leave them out.")
]
Thin = Annotated[
    int, typer.Option(help="Use one in so many sources, for a quick look or nuts.", min=1)
]
Seed = Annotated[int, typer.Option(help="Seed of svi and nuts.", min=0)]
Steps = Annotated[
    int | None, typer.Option(help="Steps over which svi's learning rate falls.", min=1)
]
Compat = Annotated[
    str | None,
    typer.Option(help="warpfield: svi in the units and with the rates of the published code."),
]

REFERENCE = typer.Argument(
    help="Reference catalogue: FITS, VOTable, ECSV, CSV or Parquet.", metavar="REF"
)
Truth = Annotated[
    Path | None, typer.Option(help="True catalogue of a simulation, to compare with.")
]
Orbit = Annotated[int | None, typer.Option(help="Orbit to take where the file holds several.")]
Instrument = Annotated[
    Path | None, typer.Option(help="Instrument as a TOML file; the mini-mock's by default.")
]
Port = Annotated[
    int, typer.Option(help="TCP port to serve on; 0 takes a free one.", min=0, max=65535)
]
Address = Annotated[
    str, typer.Option(help="Interface to serve on. Only this machine can reach the default.")
]
OpenBrowser = Annotated[
    bool, typer.Option("--open/--no-open", help="Open the page in your browser.")
]


def fit_settings(
    prior: list[str] | None,
    centre: list[str] | None,
    exclude: list[str] | None,
    **choices: object,
) -> FitSettings:
    """Return the settings that options make.

    Parameters
    ----------
    prior, centre, exclude : texts as people write them
    choices : of `FitSettings`, by name

    Raises
    ------
    InputError
        If one of them cannot be used.
    """
    return FitSettings(
        prior_widths=_prior_widths(prior or []),
        prior_shifts=dict(map(parse_shift, centre or [])),
        exclusions=parse_exclusions(exclude or []),
        **choices,  # type: ignore[arg-type]
    )


def _prior_widths(texts: list[str]) -> dict[str, float]:
    widths = {}
    for text in texts:
        name, found, value = text.partition("=")
        if not found:
            raise InputError(f"--prior: expected GROUP=VALUE, found {text!r}")
        widths[name.strip()] = parse_width(name.strip(), value)
    return widths
