"""SelectionBar: the selection in words."""

import pytest

from plateviz.dashboard.views.selection_bar import words


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
