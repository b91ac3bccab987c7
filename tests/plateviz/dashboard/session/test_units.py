"""Units: one unit of angles in the texts and tables of a page."""

import pandas as pd
import pytest

from plateviz.dashboard.session.units import NAMES, Units
from plateviz.dashboard.views.dialogs.selection_list import SelectionList
from plateviz.dashboard.views.pages.source import SourcePage
from plateviz.plots.workspace import SourceWorkspace
from plateviz.tables.headings import MOTION, ORBITS_OF_SOURCE
from solver.data.instrument import MINI_MOCK


@pytest.fixture
def units():
    return Units(MINI_MOCK)


def test_own_units_change_nothing(units):
    table = pd.DataFrame({"unit": ["mas", "mas/yr"], "fit": [1.0, 2.0]})
    assert units.rows(table) is table
    assert units.text("0.5 mas = 500 µas") == "0.5 mas = 500 µas"
    assert units.headings(ORBITS_OF_SOURCE) == ORBITS_OF_SOURCE


def test_columns_of_angles_and_their_headings_are_in_the_unit(units):
    units.unit = "µas"
    table = pd.DataFrame({name: [1.5] for name in ORBITS_OF_SOURCE})
    shown, headings = units.columns(table, ORBITS_OF_SOURCE), units.headings(ORBITS_OF_SOURCE)
    assert headings["offset_ra"] == ("Δα cos δ", "0,0", "− catalogue, µas")
    assert headings["chi2_per_dof"] == ORBITS_OF_SOURCE["chi2_per_dof"]
    angles = [name for name, one in ORBITS_OF_SOURCE.items() if one.group.endswith(", mas")]
    assert len(angles) == 6
    assert {name: shown[name].iloc[0] for name in shown} == {
        name: 1500.0 if name in angles else 1.5 for name in ORBITS_OF_SOURCE
    }


def test_rows_have_a_unit_each(units):
    units.unit = "µas"
    table = pd.DataFrame(
        {"parameter": ["ra", "pmra", "n"], "unit": ["mas", "mas/yr", ""], "fit": 0.5, "pull": 2.0}
    )
    shown = units.rows(table)
    assert shown["unit"].tolist() == ["µas", "µas/yr", ""]
    assert shown["fit"].tolist() == [500.0, 500.0, 0.5]
    assert shown["pull"].tolist() == [2.0] * 3
    assert "pull" in MOTION


def test_changes_have_the_unit_of_their_labels(units):
    rows = [
        ("Median marginal σ in δ (mas)", "1.2000", "", "+0.0500"),
        ("Median σ of proper motion (mas/yr)", "0.20", "0.10", "-0.10"),
        ("Sources", "1,200", "12", "-1,188"),
    ]
    table = pd.DataFrame(rows, columns=["what", "a", "b", "change"])
    assert units.changes(table) is table
    units.unit = "µas"
    shown = units.changes(table)
    assert shown["what"].tolist() == [
        "Median marginal σ in δ (µas)",
        "Median σ of proper motion (µas/yr)",
        "Sources",
    ]
    assert shown.iloc[0, 1:].tolist() == ["1,200.0", "", "+50.0"]
    assert shown.iloc[1, 1:].tolist() == ["200", "100", "−100"]
    assert shown.iloc[2].tolist() == list(rows[2])


def test_unit_is_in_the_address(navigation):
    navigation.begin({"unit": "furlong"})
    assert "unit" not in navigation.address()
    navigation.begin({"unit": "mpix"})
    assert navigation.session.units.unit == "mpix"
    assert navigation.address()["unit"] == "mpix"
    assert set(navigation.session.units.param["unit"].objects) == set(NAMES.values())


def test_page_of_a_source_follows_the_unit(navigation, survey):
    source = int(survey.motions["source_id"].iloc[0])
    navigation.open_source(str(source))
    page = SourcePage(navigation, lambda *_: None)
    assert page._orbits._table.value.empty
    # The tables are filled when they are looked at.
    navigation.turn_to_workspace(SourceWorkspace.ORBITS)
    before = page._orbits._table.value["sigma_ra_marginal"]
    assert len(before) > 0
    assert " mas" in page._strip.object
    navigation.session.units.unit = "µas"
    (table,) = page._orbits.__panel__()
    assert "marginal σ, µas" in table.groups
    assert table.value["sigma_ra_marginal"].tolist() == (1000.0 * before).tolist()
    assert "<td>µas</td>" in page._motion.object
    assert " mas" not in page._strip.object
    assert " µas" in page._strip.object


def test_list_of_the_selection_is_in_the_unit(navigation, fit_result):
    navigation.open_orbit(0)
    session = navigation.session
    session.units.unit = "µas"
    session.selection.select_sources(frozenset(fit_result.sources["source_id"].tolist()[:1]))
    window = SelectionList(navigation)
    window.open()
    (table,) = window._tables["sources"].__panel__()
    sigma = float(fit_result.sources["sigma_ra_marginal"].iloc[0])
    assert table.value["sigma_ra_marginal"].tolist() == pytest.approx([1000.0 * sigma])
