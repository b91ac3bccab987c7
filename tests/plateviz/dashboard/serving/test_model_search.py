"""Bokeh looks for the models of a page once after many changes, and not without a change."""

import pytest
from bokeh.document import Document
from bokeh.models import Column, Div, Row

from plateviz.dashboard.serving.model_search import one_search

pytestmark = pytest.mark.newest


@pytest.fixture
def page(monkeypatch):
    """A document with a column, and how often Bokeh has looked for its models."""
    document, column, searches = Document(), Column(), []
    document.add_root(column)
    references = Column.references

    def counted(model):
        searches.append(model)
        return references(model)

    monkeypatch.setattr(Column, "references", counted)
    return document, column, searches


def test_nothing_changed_needs_no_search(page):
    document, column, searches = page
    with one_search(document):
        column.width = 3
    assert not searches


def test_many_changes_need_one_search(page):
    document, column, searches = page
    with one_search(document):
        column.children = [place := Row(), Div(text="last")]
        with document.models.freeze(), one_search(document):
            place.children = [inner := Div(text="inner")]
        assert not searches
    assert len(searches) == 1
    assert inner.document is document


def test_afterwards_bokeh_looks_at_once(page):
    document, column, searches = page
    first = Div()

    def fail():
        with one_search(document):
            column.children = [first]
            raise KeyError

    with pytest.raises(KeyError):
        fail()
    assert first.document is document
    column.children = []
    assert len(searches) == 2
    assert first.document is None


def test_without_a_document_nothing_is_kept_from_its_search(page):
    _, column, searches = page
    with one_search(None):
        column.children = [Div()]
        assert len(searches) == 1
