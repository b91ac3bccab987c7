"""SelectionBar: the selection in words."""

from types import SimpleNamespace

import panel as pn
import pytest

from plateviz.dashboard.navigation import Navigation
from plateviz.dashboard.session import Session
from plateviz.dashboard.table_sender import TableSender
from plateviz.dashboard.views.selection_bar import SelectionBar, is_read_here, words
from solver.errors import InputError
from tests.plateviz.dashboard.test_navigation import SurveyStore


@pytest.mark.parametrize(
    ("n_selected", "n_in_orbit", "is_orbit", "text"),
    [
        (1, 1, True, "1 source selected"),
        (1320, 1320, True, "1,320 sources selected"),
        (132, 57, True, "132 sources selected, 57 of them in this orbit"),
        (132, 0, True, "132 sources selected, none in this orbit"),
        (132, 0, False, "132 sources selected"),
    ],
)
def test_selection_in_words(n_selected, n_in_orbit, is_orbit, text):
    assert words(n_selected, n_in_orbit, is_orbit) == text


@pytest.fixture
def bar(fit_result):
    session = Session(SurveyStore(fit_result, []))
    session.show_result(0, fit_result)
    navigation = Navigation(session)
    made = SelectionBar(navigation)
    session.select_sources(frozenset(fit_result.sources["source_id"].iloc[:2].tolist()))
    return made


def test_sources_are_sent_from_a_page_on_this_machine(bar, monkeypatch):
    sent = []
    monkeypatch.setattr(TableSender, "send", lambda _, *what: sent.append(what) or "2 sent.")
    bar._is_here = True
    assert bar._send().make(print).words == "2 sent."
    ((table, name),) = sent
    assert (len(table), name) == (2, "orbit-0-selection")


def test_page_on_another_machine_says_why_nothing_is_sent(bar):
    # There is no request, so that nothing says that the page is read here.
    with pytest.raises(InputError, match="on another machine or through a proxy; Save, VOTable"):
        bar._send()


def test_request_of_a_session_tells_where_its_page_is_read(monkeypatch):
    for address, is_here in (("127.0.0.1", True), ("192.0.2.7", False)):
        request = SimpleNamespace(remote_ip=address, headers={"Host": "localhost:5006"})
        document = SimpleNamespace(session_context=SimpleNamespace(request=request))
        monkeypatch.setattr(type(pn.state), "curdoc", document)
        assert is_read_here() is is_here
