"""Figures of reports: dark figures by replaced colours, and reproducible bytes."""

import gzip
import json
import re
from base64 import b64decode
from dataclasses import replace
from types import SimpleNamespace

import pytest

from plateviz.plots.diagnostic import Chosen
from plateviz.plots.gallery import diagnostics, source_figures, survey_figures
from plateviz.reports.figure import dark_colours, packed_document
from plateviz.tables.survey_tables import SourceTables, SurveyTables

DIAGNOSTICS = {d.name: d for d in diagnostics()}
OF_SURVEY = {f.name: f for f in survey_figures()}
OF_SOURCE = {f.name: f for f in source_figures()}


@pytest.fixture(scope="module")
def plotted(compared, instrument, survey):
    """Return the function that returns any figure, by its name."""
    pairs = compared.exposures[["field_id", "plate_id"]].itertuples(index=False)
    whole = Chosen(compared, instrument, tuple(map(tuple, pairs)), other=compared)
    surveyed = SurveyTables(survey.orbits, survey.motions, survey.catalogue, survey.truth)
    surveyed = replace(surveyed, other=surveyed)
    source = SourceTables(*survey.source("other"))

    def figure(name):
        if name in DIAGNOSTICS:
            return DIAGNOSTICS[name].plot(whole)
        if name in OF_SURVEY:
            return OF_SURVEY[name].plot(surveyed)
        return OF_SOURCE[name].plot(source)

    return figure


def unpacked(figure, theme="light"):
    return json.loads(gzip.decompress(b64decode(packed_document(figure, theme))))


def darkened(part, table):
    """Replace the colours as the page does in the browser."""
    if isinstance(part, str):
        return table.colours.get(part, part)
    if isinstance(part, list):
        found = [dark for light, dark in table.palettes if part == light]
        return found[0] if found else [darkened(value, table) for value in part]
    if isinstance(part, dict):
        return {key: darkened(value, table) for key, value in part.items()}
    return part


@pytest.mark.parametrize("name", [*DIAGNOSTICS, *OF_SURVEY, *OF_SOURCE])
def test_light_figure_with_replaced_colours_is_the_dark_figure(plotted, name):
    table = SimpleNamespace(**dark_colours())
    expected = unpacked(plotted(name), "dark")
    assert darkened(unpacked(plotted(name)), table) == darkened(expected, table)


def test_figure_drawn_twice_has_the_same_bytes(plotted):
    assert packed_document(plotted("deviation")) == packed_document(plotted("deviation"))


def test_model_ids_are_counted_from_one(plotted):
    found = set(re.findall(r'"id": "(\w+)"', json.dumps(unpacked(plotted("pulls")))))
    assert found == {f"m{number + 1}" for number in range(len(found))}


def test_white_background_is_explicit(plotted):
    (plot, _, _) = unpacked(plotted("pulls"))["roots"][0]["attributes"]["children"][0]
    assert plot["attributes"]["border_fill_color"] == "#ffffff"
