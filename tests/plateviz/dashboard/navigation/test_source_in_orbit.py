"""A source is opened in one of its orbits: selected, and shown where it was measured first."""

import pandas as pd
import pytest

from plateviz.dashboard.navigation.navigation import View
from plateviz.dashboard.navigation.source_in_orbit import open_source_in_orbit
from plateviz.dashboard.views.pages.source import SourcePage
from plateviz.plots.workspace import OrbitWorkspace, SourceWorkspace
from solver.data.subset import Subset
from tests.plateviz.dashboard.navigation.test_navigation import end_job


@pytest.fixture
def star(fit_result):
    """The source of the last exposure that begins latest, and its first measurement."""
    rows = fit_result.residuals.sort_values(["field_id", "plate_id"], kind="stable")
    first = rows.groupby("source_id").first()
    source = first.sort_values(["field_id", "plate_id"]).index[-1]
    return int(source), first.loc[source]


def place(row):
    plate = int(row["plate_id"])
    return str(int(row["field_id"])), (plate, plate), str(int(row["detector_id"]))


def shown(navigation):
    part = navigation.session.shown_part
    return part.field, part.plates, part.detector


def test_orbit_opens_where_the_source_was_measured_first(navigation, star):
    source, row = star
    selection = navigation.session.selection
    navigation.open_orbit(0)
    navigation.turn_to_workspace(OrbitWorkspace.SKY)
    detectors = set(navigation.session._detectors) - {int(row["detector_id"])}
    navigation.session.shown_part.detector = str(detectors.pop())
    selection.exposures = frozenset({(0, 1)})
    navigation.turn_to(View.SOURCE)
    open_source_in_orbit(navigation, source, 0)
    assert (navigation.view, navigation.workspace) == (View.ORBIT, OrbitWorkspace.RESIDUALS)
    assert selection.selected == Subset(sources=frozenset({source}))
    assert shown(navigation) == place(row)


def test_place_that_shows_the_source_stays(navigation, star):
    source, _ = star
    part = navigation.session.shown_part
    navigation.open_orbit(0)
    low, high = part.param["plates"].bounds
    part.param.update(field="all", plates=(low, high), detector="all")
    before = shown(navigation)
    open_source_in_orbit(navigation, source, 0)
    assert shown(navigation) == before


def test_place_follows_the_fit_of_an_orbit_that_the_run_lacks(navigation, star):
    source, row = star
    open_source_in_orbit(navigation, source, 1)
    assert navigation.session.job is not None
    end_job(navigation)
    assert navigation.session.shown.orbit == 1
    assert shown(navigation) == place(row)
    # Once only.
    navigation.session.shown_part.detector = "all"
    navigation.session.refit()
    end_job(navigation)
    assert navigation.session.shown_part.detector == "all"


def test_source_without_a_measurement_is_said(navigation):
    open_source_in_orbit(navigation, -7, 0)
    assert "has no measurement of -7" in navigation.session.notice


def test_row_of_the_source_page_opens_the_orbit_with_the_source(navigation, survey):
    source = int(survey.history["source_id"].iloc[0])
    navigation.open_source(str(source))
    navigation.turn_to_workspace(SourceWorkspace.ORBITS)
    page = SourcePage(navigation, lambda *_: None)
    assert "with this source selected" in page._measurements.object
    page._open_row(pd.Series({"orbit_id": 0}))
    assert (navigation.view, navigation.workspace) == (View.ORBIT, OrbitWorkspace.RESIDUALS)
    assert navigation.session.selection.sources == {source}
