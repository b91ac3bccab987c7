"""The selected sources as tables."""

import numpy as np
import pytest

from plateviz.dashboard.navigation.navigation import Navigation, View
from plateviz.dashboard.saving import selected_tables as module
from plateviz.dashboard.saving.selected_tables import (
    selected_places,
    selected_tables,
    selection_name,
)
from plateviz.dashboard.session.session import Session
from solver.errors import InputError
from tests.plateviz.dashboard.fake_survey import FakeRun, SurveyStore


@pytest.fixture
def navigation(fit_result, survey, monkeypatch):
    run = FakeRun("default", survey, fit_result)
    run.motions = lambda: survey.motions
    monkeypatch.setattr(module, "read_survey_table", lambda path, schema: survey.catalogue)
    return Navigation(Session(SurveyStore(fit_result, [run])))


def test_places_of_a_solution_are_those_of_its_sources(navigation, fit_result):
    navigation.turn_to(View.ORBIT)
    some = fit_result.sources["source_id"].iloc[:3].tolist()
    navigation.session.selection.select_sources(frozenset([*some, 17]))
    assert selection_name(navigation) == "orbit-0-selection"
    make = selected_places(navigation)
    # What is selected when it is sent counts, not what follows.
    navigation.session.selection.select_sources(frozenset())
    table = make()
    assert sorted(table["source_id"]) == sorted(some)
    assert {"ra", "dec", "ra_sigma_marginal"} & set(table.colnames) >= {"ra", "dec"}
    assert (str(table["ra"].unit), table["dec"].meta["ucd"]) == ("deg", "pos.eq.dec;meta.main")


def test_places_of_a_run_are_those_of_the_catalogue(navigation, survey):
    some = survey.motions["source_id"].iloc[[4, 1]].tolist()
    navigation.session.selection.select_sources(frozenset(some))
    assert selection_name(navigation) == "run-default-selection"
    table = selected_places(navigation)()
    catalogue = survey.catalogue.set_index("source_id")
    assert sorted(table["source_id"]) == sorted(some)
    assert np.array_equal(table["ra"], catalogue.loc[table["source_id"], "ra"])
    assert "fit_pmra" in table.colnames
    assert list(selected_tables(navigation)) == ["sources"]


def test_selection_without_a_place_is_refused(navigation, fit_result):
    navigation.turn_to(View.ORBIT)
    navigation.session.selection.select_sources(frozenset([17]))
    with pytest.raises(InputError, match="in the solution on the screen; if they are left out"):
        selected_places(navigation)()
    empty = Navigation(Session(SurveyStore(fit_result, [])))
    with pytest.raises(InputError, match="no solution and no run is on the screen"):
        selected_places(empty)
