"""Saved views: what is read back, and what is said of damaged and foreign ones."""

import json
from urllib.parse import urlencode

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from plateviz.dashboard.navigation.navigation import Navigation
from plateviz.dashboard.navigation.saved_view import MOST_BYTES, open_view, view_text
from plateviz.dashboard.session.session import Session
from plateviz.dashboard.views.saving.view_file import ViewFile
from plateviz.plots.workspace import OrbitWorkspace
from solver.data.settings import FitSettings
from solver.data.subset import Subset
from solver.errors import InputError
from tests.plateviz.dashboard.fake_survey import FakeRun, SurveyStore
from tests.plateviz.dashboard.navigation.test_navigation import end_job


@pytest.fixture
def page(navigation):
    navigation.open_orbit(0)
    navigation.turn_to_workspace(OrbitWorkspace.SKY)
    navigation.session.selection.select_sources(frozenset(range(100)))
    return navigation


def another(page):
    return Navigation(Session(page.session.store))


def changed(page, **parts):
    return json.dumps({**json.loads(view_text(page)), **parts})


def test_view_is_opened_with_its_whole_selection(page):
    opened = another(page)
    open_view(opened, view_text(page))
    assert opened.address() == page.address()
    assert opened.session.selection.sources == frozenset(range(100))
    assert opened.session.notice == ""


def test_view_has_its_selection_whatever_is_kept_under_its_name(page):
    selection = page.session.selection
    selection.kept = {"all": selection.selected}
    assert page.address()["selection"] == "all"
    opened = another(page)
    open_view(opened, view_text(page))
    assert opened.session.selection.selected == selection.selected
    assert opened.session.notice == ""


def test_figure_of_both_solutions_is_in_the_address_and_in_a_view(page):
    page.turn_to_workspace(OrbitWorkspace.ORDERS)
    page.session.figure_of_both = "exposure-tracks"
    assert page.address()["both"] == "exposure-tracks"
    opened = another(page)
    open_view(opened, view_text(page))
    assert opened.session.figure_of_both == "exposure-tracks"
    # Back to another figure, and a file of before.
    opened.begin(page.address() | {"both": "residual-map"})
    assert opened.session.figure_of_both == "residual-map"
    address = {name: value for name, value in page.address().items() if name != "both"}
    open_view(opened, changed(page, address=address))
    assert (opened.session.figure_of_both, opened.session.notice) == ("residual-map", "")
    opened.begin(page.address() | {"both": "<b>"})
    assert "both: expected footprint, " in opened.session.notice
    assert opened.session.figure_of_both == "residual-map"


def test_settings_that_are_too_long_for_an_address_are_in_a_view(page):
    left_out = Subset(sources=frozenset(range(10**15, 10**15 + 300)))
    page.session.choices.what_if_at_once = False
    page.session.choices.load(FitSettings(exclusions=left_out))
    page.session.refit()
    end_job(page)
    assert page.address()["solution"].startswith("sources=many:")
    opened = another(page)
    open_view(opened, view_text(page))
    end_job(opened)
    assert opened.session.shown.settings.exclusions == left_out


def test_view_of_a_run_that_is_gone_is_fitted_with_its_settings(page, fit_result, survey):
    runs = [FakeRun("other", survey, fit_result, FitSettings(order=3))]
    opened = Navigation(Session(SurveyStore(fit_result, runs)))
    open_view(opened, view_text(page))
    assert "run: expected other, found 'default'" in opened.session.notice
    end_job(opened)
    assert opened.session.shown.settings == FitSettings()
    assert opened.workspace is OrbitWorkspace.SKY
    assert len(opened.session.selection.sources) == 100


def test_view_of_another_survey_says_so(page):
    opened = another(page)
    open_view(opened, changed(page, of="<b>elsewhere</b>"))
    assert "the view is of '<b>elsewhere</b>', and this page of 'store'" in opened.session.notice


def test_more_sources_than_a_view_holds_are_refused(page):
    page.session.selection.select_sources(frozenset(range(30_001)))
    with pytest.raises(InputError, match="30,001 are selected: save these as a table"):
        view_text(page)


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("", "no JSON"),
        ("{", "no JSON"),
        ("[" * 100_000, "no JSON"),
        ("9" * 10_000, "no JSON"),
        ("[]", "with format 'plateviz view'"),
        ('{"format": "other"}', "with format 'plateviz view'"),
        ("x" * (MOST_BYTES + 1), "800,000 bytes or fewer"),
    ],
    ids=["empty", "half", "nested", "number", "list", "other", "large"],
)
def test_file_that_is_no_view_is_refused_and_changes_nothing(page, text, told):
    before = page.address()
    with pytest.raises(InputError, match=told):
        open_view(page, text)
    assert page.address() == before
    assert len(page.session.selection.sources) == 100


@pytest.mark.parametrize(
    ("part", "value", "told"),
    [
        ("version", 2, "version 1 or older, found 2"),
        ("version", "1", "version 1 or older"),
        ("version", True, "version 1 or older"),
        ("address", ["view"], "parts of an address as texts"),
        ("address", {"view": 3}, "parts of an address as texts"),
        ("address", {str(n): "" for n in range(100)}, "parts of an address as texts"),
        ("sources", None, "ids of sources"),
        ("sources", [1.5], "ids of sources"),
        ("sources", [True], "ids of sources"),
        ("sources", [2**63], "ids of sources"),
        ("sources", list(range(30_001)), "ids of sources"),
    ],
)
def test_damaged_view_is_refused_and_changes_nothing(page, part, value, told):
    before = page.address()
    with pytest.raises(InputError, match=told):
        open_view(page, changed(page, **{part: value}))
    assert page.address() == before


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture], max_examples=50)
@given(
    st.dictionaries(
        st.sampled_from(["view", "workspace", "orbit", "run", "field", "plates", "source"]),
        st.text(max_size=20),
    )
)
def test_hostile_address_in_a_view_is_told_in_a_notice(page, address):
    open_view(page, changed(page, address=address, sources=[]))


def test_half_a_character_is_no_part_of_the_next_address(navigation):
    text = changed(
        navigation, address={"view": "survey", "solution": "order=\ud800", "field": "\ud800"}
    )
    open_view(navigation, text)
    assert urlencode(navigation.address())


def test_file_from_the_browser_is_opened_or_refused_in_a_notice(page):
    file, sent = ViewFile(page), []
    file._send_msg = sent.append
    file._handle_msg({})
    assert sent[0]["name"] == "store-view.json"
    page.turn_to_workspace(OrbitWorkspace.VERDICT)
    file._handle_msg({"text": sent[0]["text"]})
    assert page.workspace is OrbitWorkspace.SKY
    for hostile in (None, 3, "nonsense", {"a": 1}):
        file._handle_msg({"text": hostile})
        assert page.session.notice.startswith("The view was not opened: expected a saved view")
