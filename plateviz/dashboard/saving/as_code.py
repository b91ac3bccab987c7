"""A solution and its figures as code: the command line and the Python that make them again."""

import math
import shlex
from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING

from plateviz.solving.origin import OrbitFiles, Origin, SurveyFolder
from solver.data.engine_settings import ENGINE_OPTIONS, engine_options
from solver.data.setting_kinds import Setting
from solver.data.setting_words import options_of
from solver.data.settings import DEFAULTS, SETTINGS, FitSettings
from solver.data.text_setting import LeftOut, Texts

if TYPE_CHECKING:
    from plateviz.plots.explore.explored_rows import ExploredColumns

NAME = "reproduced"
"""Name of the run, or of the result file, that the command writes."""
PREAMBLE = "import plateviz\n\n"
FigureCall = tuple[str, Mapping[str, object]]
"""Name of a figure, and the keywords with which it is drawn."""


def as_command(
    origin: Origin,
    orbit: int | None,
    settings: FitSettings,
    name: str = NAME,
    accept: bool = False,
) -> str:
    """Return the command line that makes a solution.

    Parameters
    ----------
    orbit : orbit_id; None if the origin is files with one orbit only
    name : of the run, or of the result file without its suffix
    accept : whether it ends well for a solution that should not be trusted, too

    Raises
    ------
    ValueError
        If a survey is given without an orbit.
    """
    accepted = ["--accept"] if accept else []
    if isinstance(origin, SurveyFolder):
        if orbit is None:
            raise ValueError("orbit: expected an orbit_id of the survey, found None")
        words = ["plateviz", "survey", origin.directory, "--run", name, "--orbits", str(orbit)]
        return _in_lines(words + accepted, _options(settings, "survey"))
    words = ["plateviz", "fit", origin.observations, origin.reference, "-o", f"{name}.fits"]
    for name, value in _files(origin):
        words += [f"--{name}", str(value)]
    return _in_lines(words + accepted, _options(settings, "fit"))


def report_command(
    origin: Origin,
    orbit: int | None,
    other: str | None = None,
    more: Sequence[str] = (),
    name: str = NAME,
) -> str:
    """Return the command line that draws the figures of what `as_command` has made.

    Parameters
    ----------
    orbit : as of `as_command`
    other : name of a second solution that it has made, to compare with; None for none
    more : further options and their values
    name : as of `as_command`
    """
    if isinstance(origin, SurveyFolder):
        made = [origin.directory, "--run", name, "--orbit", str(orbit)]
        compared = [] if other is None else ["--other", other]
    else:
        camera = [] if origin.instrument is None else ["--instrument", origin.instrument]
        made = [f"{name}.fits", *camera]
        compared = [] if other is None else ["--other", f"{other}.fits"]
    return shlex.join(["plateviz", "report", *made, *compared, *more, "-o", f"{name}.html"])


def report_of_run(survey: str, run: str, *options: str) -> str:
    """Return the command line that reports a run, or what of it the options name."""
    words = ["plateviz", "report", survey, "--run", run, *options, "-o", "REPORT.html"]
    return shlex.join(words)


def as_python(
    origin: Origin, orbit: int | None, settings: FitSettings, name: str = "solution"
) -> str:
    """Return Python that makes a solution; parameters as for `as_command`.

    Parameters
    ----------
    name : of the variable
    """
    if isinstance(origin, SurveyFolder):
        opened = f"plateviz.open({origin.directory!r}).orbit({orbit})"
    else:
        files = "".join(f", {name}={value!r}" for name, value in _files(origin))
        opened = f"plateviz.open({origin.observations!r}, {origin.reference!r}{files})"
    changes = {
        one.keyword: _python_value(one, getattr(settings, name))
        for name, one in _changed(settings)
        if one.keyword
    } | engine_options(settings.svi, settings.nuts)
    arguments = ", ".join(f"{keyword}={value!r}" for keyword, value in changes.items())
    return f"{PREAMBLE}{name} = {opened}.fit({arguments})"


def explored_as_python(variable: str, rows: str, chosen: "ExploredColumns", theme: str) -> str:
    """Return Python that draws what *Explore* draws of a solution or a run."""
    arguments = [repr(one) for one in (rows, chosen.x, chosen.y)]
    between = tuple(one if math.isfinite(one) else None for one in (chosen.lowest, chosen.highest))
    keywords = {
        "colour": chosen.colour,
        "only": chosen.only,
        "between": between if chosen.only and between != (None, None) else None,
        "log_x": chosen.is_log_x,
        "log_y": chosen.is_log_y,
        "median": chosen.has_median,
        "zoom": chosen.limits,
        "theme": "" if theme == "light" else theme,
    }
    arguments += [f"{name}={value!r}" for name, value in keywords.items() if value]
    return f"figures = [\n    {variable}.explore({', '.join(arguments)}),\n]"


def figures_as_python(variable: str, figures: Sequence[FigureCall]) -> str:
    """Return Python that draws figures of a solution, a run or a source; none of no figures."""
    calls = []
    for name, keywords in figures:
        arguments = [repr(name), *(f"{one}={value!r}" for one, value in keywords.items())]
        calls.append(f"    {variable}.figure({', '.join(arguments)}),\n")
    return f"figures = [\n{''.join(calls)}]" if calls else ""


def _files(origin: OrbitFiles) -> Iterator[tuple[str, object]]:
    """Yield option or keyword, and value, of what is given besides the two inputs."""
    for name in ("truth", "instrument", "orbit"):
        if (value := getattr(origin, name)) is not None:
            yield name, value


def _changed(settings: FitSettings) -> Iterator[tuple[str, Setting]]:
    for name, one in SETTINGS.items():
        if getattr(settings, name) != DEFAULTS[name]:
            yield name, one


def _options(settings: FitSettings, command: str) -> list[list[str]]:
    """Return the options of all settings that are not the paper's, each with its value."""
    return [
        [f"--{one.name}"] if one.value is None else [f"--{one.name}", one.value]
        for one in options_of(settings)
        # The engines' options are given to both commands: one that lacks them says so.
        if command in one.commands or one.name in ENGINE_OPTIONS
    ]


def _python_value(one: Setting, value: object) -> object:
    if not isinstance(one, Texts):
        return value
    texts = one.texts(value)
    return texts if isinstance(one, LeftOut) else dict(text.split("=", 1) for text in texts)


def _in_lines(words: list[str], options: list[list[str]]) -> str:
    return " \\\n  ".join(shlex.join(part) for part in (words, *options))
