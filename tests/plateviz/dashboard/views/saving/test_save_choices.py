"""What a figure is saved as: ids in its files are those of the other files."""

import numpy as np
import pandas as pd
import pytest
from astropy.table import Table

from plateviz.dashboard.views.saving.save_choices import FigureOnScreen, Saved, figure_choices
from plateviz.figures.figure import Axis, framed
from plateviz.figures.glyphs import points

IDS = [7, 4611686018427387904, 9]


def saved(folder, form):
    """Return the data of a figure with three sources as they are read from their file."""
    table = pd.DataFrame({"x": 1.0, "y": 2.0, "id": list(map(str, IDS))})
    marks = points(table, "x", "y", name="sources", color="mark", hover=[("source", "@{id}")])
    axes = {"x": Axis("x (mm)", (0.0, 5.0)), "y": Axis("y", (0.0, 4.0))}
    figure = framed([marks], title="Title", width=200, **axes)
    choices = figure_choices("map", lambda: FigureOnScreen(figure, "light"), Saved())
    made = choices[f"Data as {form}"]()
    (folder / made.name).write_bytes(made.content)
    return Table.read(folder / made.name)


@pytest.mark.parametrize("form", ["ECSV", "Parquet", "CSV"])
def test_ids_of_sources_are_whole_numbers(tmp_path, form):
    found = saved(tmp_path, form)["id"]
    assert found.dtype == np.int64
    assert list(found) == IDS


@pytest.mark.parametrize("form", ["ECSV", "Parquet", "FITS", "VOTable"])
def test_files_have_the_units_of_columns(tmp_path, form):
    assert saved(tmp_path, form)["x"].unit == "mm"
