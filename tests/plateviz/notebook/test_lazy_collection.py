"""LazyCollection: items by name and by attribute, made on access, with Tab completion."""

import pytest

from plateviz.notebook.lazy_collection import LazyCollection
from solver.errors import InputError


@pytest.fixture
def figures():
    return LazyCollection("figure", {"residual-map": lambda: "drawn", "pulls": lambda: 1 / 0})


def test_item_is_found_by_name_and_by_attribute(figures):
    assert figures["residual-map"] == figures.residual_map == "drawn"


def test_item_is_made_on_access(figures):
    with pytest.raises(ZeroDivisionError):
        figures["pulls"]


def test_tab_completion_lists_the_names(figures):
    assert {"residual_map", "pulls"} <= set(dir(figures))
    assert figures._ipython_key_completions_() == ["residual-map", "pulls"]


def test_collection_has_a_length_and_contains_its_names(figures):
    assert (len(figures), list(figures)) == (2, ["residual-map", "pulls"])
    assert "pulls" in figures
    assert "pull" not in figures
    assert repr(figures) == "figures: residual-map, pulls"


def test_unknown_name_is_refused_with_the_nearest(figures):
    with pytest.raises(InputError, match="out of residual-map, pulls, found 'residual_map'"):
        figures["residual_map"]
    with pytest.raises(InputError, match="did you mean residual-map"):
        figures["residuals-map"]


def test_unknown_attribute_is_an_attribute_error(figures):
    with pytest.raises(AttributeError, match="found 'residuals_map'; did you mean residual_map"):
        figures.residuals_map  # noqa: B018
    assert not hasattr(figures, "_repr_html_")
