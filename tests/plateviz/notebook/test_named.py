"""Things by their names: as items, as attributes, for who presses Tab; made when asked for."""

import pytest

from plateviz.notebook.named import Named
from solver.errors import InputError


@pytest.fixture
def figures():
    return Named("figure", {"residual-map": lambda: "drawn", "pulls": lambda: 1 / 0})


def test_a_name_is_an_item_and_an_attribute(figures):
    assert figures["residual-map"] == figures.residual_map == "drawn"


def test_nothing_is_made_before_it_is_asked_for(figures):
    with pytest.raises(ZeroDivisionError):
        figures["pulls"]


def test_tab_lists_the_names(figures):
    assert {"residual_map", "pulls"} <= set(dir(figures))
    assert figures._ipython_key_completions_() == ["residual-map", "pulls"]


def test_names_can_be_counted_and_looked_for(figures):
    assert (len(figures), list(figures)) == (2, ["residual-map", "pulls"])
    assert "pulls" in figures
    assert "pull" not in figures
    assert repr(figures) == "figures: residual-map, pulls"


def test_another_name_is_refused_and_the_nearest_named(figures):
    with pytest.raises(InputError, match="out of residual-map, pulls, found 'residual_map'"):
        figures["residual_map"]
    with pytest.raises(InputError, match="did you mean residual-map"):
        figures["residuals-map"]


def test_another_attribute_is_refused_as_python_does(figures):
    with pytest.raises(AttributeError, match="found 'residuals_map'; did you mean residual_map"):
        figures.residuals_map  # noqa: B018
    assert not hasattr(figures, "_repr_html_")
