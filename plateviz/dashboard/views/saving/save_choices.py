"""What figures and tables of the dashboard can be saved as."""

from collections.abc import Callable, Mapping
from functools import partial
from typing import NamedTuple

import numpy as np
from astropy.table import Column, Table
from bokeh.core.enums import OutputBackendType
from bokeh.embed import json_item

from plateviz.dashboard.saving.downloads import FORMATS, Download, as_file, file_name
from plateviz.dashboard.views.saving.save_button import Choices, Picture
from plateviz.figures.bokeh_figure import BokehFigure
from plateviz.figures.figure import Figure
from plateviz.figures.figure_tables import figure_tables
from solver.errors import InputError

_PICTURES: Mapping[str, OutputBackendType] = {"png": "canvas", "svg": "svg"}

# Columns of figures with the ids that the tables of files have.
_IDS = {"id", "orbit_id", "detector_id"}


class FigureOnScreen(NamedTuple):
    """A figure in its size and with its limits on the screen, and its theme."""

    figure: Figure
    theme: str


class Saved(NamedTuple):
    """How a figure is named in files, and what its data are.

    Attributes
    ----------
    subject : returns what the figure is of, such as "orbit-0003"; the file's name begins with it
    tables : returns the tables that are saved as its data; those of its marks by default
    """

    subject: Callable[[], str] = str
    tables: Callable[[], Mapping[str, Table]] | None = None


def figure_choices(
    name: str, on_screen: Callable[[], FigureOnScreen | None], saved: Saved
) -> Choices:
    """Return what a figure can be saved as.

    Parameters
    ----------
    name : of the figure
    on_screen : returns the figure that is shown, or None while there is none
    """

    def stem() -> str:
        return "-".join(filter(None, (saved.subject(), name)))

    def shown() -> FigureOnScreen:
        found = on_screen()
        if found is None:
            raise InputError("there is nothing to save yet")
        return found

    def picture(suffix: str) -> Picture:
        return Picture(file_name(stem(), f".{suffix}"), _item(shown(), _PICTURES[suffix]))

    def tables() -> Mapping[str, Table]:
        figure = shown().figure
        return figure_files(figure) if saved.tables is None else saved.tables()

    pictures = {suffix.upper(): partial(picture, suffix) for suffix in _PICTURES}
    data = table_choices(stem, tables)
    return pictures | {f"Data as {form}": make for form, make in data.items()}


def figure_files(figure: Figure) -> dict[str, Table]:
    """Return the tables of a figure for files, in which ids are whole numbers.

    A browser has them as text, since its numbers have fewer digits.
    """
    tables = figure_tables(figure)
    for table in tables.values():
        for name in _IDS & {*table.colnames}:
            texts = np.asarray(table[name])
            if texts.dtype.kind == "U" and np.char.isdecimal(texts).all():
                table[name] = Column(texts.astype(np.int64), description=table[name].description)
    return tables


def table_choices(stem: Callable[[], str], tables: Callable[[], Mapping[str, Table]]) -> Choices:
    """Return what tables can be saved as.

    Parameters
    ----------
    stem : returns the name of the file without its suffix
    tables : returns them by name
    """
    return {form: partial(_file, tables, stem, FORMATS[form]) for form in FORMATS}


def _file(
    tables: Callable[[], Mapping[str, Table]], stem: Callable[[], str], suffix: str
) -> Download:
    return as_file(tables(), stem(), suffix)


def _item(shown: FigureOnScreen, output_backend: OutputBackendType) -> dict[str, object]:
    """Return the figure, drawn anew, as JSON: models of the page cannot be in another document."""
    drawn = BokehFigure(shown.figure, shown.theme)
    for frame in drawn.frames:
        frame.plot.output_backend = output_backend
        frame.plot.toolbar_location = None
    return dict(json_item(drawn.model))
