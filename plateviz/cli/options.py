"""Command-line options that several commands share: those of the fit settings, and others."""

import inspect
from collections.abc import Callable, Mapping
from pathlib import Path
from types import MappingProxyType
from typing import Annotated, Any, TypeVar

import typer

from solver.data.engine_settings import ENGINE_OPTIONS, engine_settings
from solver.data.setting_kinds import Positive, Setting, Switch, Whole
from solver.data.settings import DEFAULTS, SETTINGS, FitSettings
from solver.data.text_setting import Texts

_Function = TypeVar("_Function", bound=Callable)

REFERENCE = typer.Argument(
    help="Reference catalogue: FITS, VOTable, ECSV, CSV or Parquet.", metavar="REF"
)
Truth = Annotated[
    Path | None, typer.Option(help="True catalogue of a simulation, to compare with.")
]
Orbit = Annotated[int | None, typer.Option(help="Id of the orbit, if the file holds several.")]
Instrument = Annotated[
    Path | None, typer.Option(help="Instrument (TOML file); the mini-mock's by default.")
]
Port = Annotated[
    int, typer.Option(help="TCP port to serve on; 0 selects a free port.", min=0, max=65535)
]
Address = Annotated[
    str,
    typer.Option(
        help="Network interface to serve on; the default is reachable from this machine only."
    ),
]
PasswordFile = Annotated[
    Path | None,
    typer.Option(help="File with the password to ask for; needed to serve other machines."),
]
NoPassword = Annotated[
    bool,
    typer.Option("--no-password", help="Serve other machines without a password."),
]
Overwrite = Annotated[
    bool, typer.Option("--overwrite", help="Replace an output that exists; never an input.")
]
OpenBrowser = Annotated[
    bool, typer.Option("--open/--no-open", help="Open the page in your browser.")
]


def takes_settings(
    command: str, notes: Mapping[str, str] = MappingProxyType({})
) -> Callable[[_Function], _Function]:
    """Add the options of all settings that a command offers to its function with `**settings`.

    Parameters
    ----------
    command : name of the command
    notes : option -> sentence appended to its help
    """

    def with_options(function: _Function) -> _Function:
        signature = inspect.signature(function)
        own = [p for p in signature.parameters.values() if p.kind is not p.VAR_KEYWORD]
        command_function: Any = function
        options = [_parameter(name, one, notes) for name, one in _offered(command).items()]
        command_function.__signature__ = signature.replace(parameters=[*own, *options])
        command_function.__annotations__ = {
            **{p.name: p.annotation for p in (*own, *options)},
            "return": None,
        }
        return function

    return with_options


def fit_settings(values: Mapping[str, Any]) -> FitSettings:
    """Return the settings given by the options of `takes_settings`.

    Raises
    ------
    InputError
        If an option has an invalid value.
    """
    fields = {}
    for name, one in SETTINGS.items():
        key = _python_name(one)
        if key in values:
            value = values[key]
            fields[name] = one.parse(value or []) if isinstance(one, Texts) else value
    engines = {name: values[name] for name in ENGINE_OPTIONS if name in values}
    return FitSettings(**fields, **engine_settings(**engines))


def _offered(command: str) -> dict[str, Setting]:
    """Return the settings and engine options that a command offers, by Python name."""
    every = [*SETTINGS.values(), *ENGINE_OPTIONS.values()]
    return {_python_name(one): one for one in every if one.option and command in one.commands}


def _python_name(one: Setting) -> str:
    return one.option.replace("-", "_")


def _parameter(name: str, one: Setting, notes: Mapping[str, str]) -> inspect.Parameter:
    """Return the function parameter from which typer derives the option."""
    defaults = {_python_name(SETTINGS[field]): value for field, value in DEFAULTS.items()}
    default = defaults.get(name, 0 if name == "seed" else None)
    text = f"{one.help} {notes[name]}" if name in notes else one.help
    annotation: Any = str
    option = typer.Option(f"--{one.option}", help=text)
    if isinstance(one, Switch):
        annotation = bool
        if default:
            option = typer.Option(f"--{one.option}/--no-{one.option}", help=text)
    elif isinstance(one, Whole):
        annotation = int if default is not None else int | None
        # `FitSettings` checks a setting with two bounds, with the message of every interface.
        low = one.low if one.high is None else None
        option = typer.Option(f"--{one.option}", help=text, min=low)
    elif isinstance(one, Positive):
        annotation = float
    elif isinstance(one, Texts):
        annotation, default = list[str] | None, None
        option = typer.Option(f"--{one.option}", help=text, metavar=one.metavar)
    elif default is None:
        annotation = str | None
    return inspect.Parameter(
        name,
        inspect.Parameter.KEYWORD_ONLY,
        default=default,
        annotation=Annotated[annotation, option],
    )
