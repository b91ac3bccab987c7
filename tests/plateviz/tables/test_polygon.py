"""Places inside an area, found by cells and by edges."""

import numpy as np
import pytest

from plateviz.tables.polygon import Polygon, _is_inside


def star(n_corners, seed):
    """Return corners at different distances about a middle far from zero."""
    random = np.random.default_rng(seed)
    angle = np.linspace(0.0, 2.0 * np.pi, n_corners, endpoint=False)
    reach = random.uniform(0.2, 1.0, n_corners)
    return np.stack([250.0 + reach * np.cos(angle), 1e-3 * reach * np.sin(angle)], axis=1)


@pytest.mark.parametrize("n_corners", [3, 7, 300])
@pytest.mark.parametrize("kind", [np.float32, np.float64])
def test_cells_change_no_answer(n_corners, kind):
    corners = star(n_corners, n_corners)
    random = np.random.default_rng(1)
    x = random.uniform(248.9, 251.1, 20_000).astype(kind)
    y = random.uniform(-1.1e-3, 1.1e-3, 20_000).astype(kind)
    found = Polygon(corners).contains(x, y)
    places = np.stack([x, y], axis=1).astype(float)
    np.testing.assert_array_equal(found, _is_inside(places, corners))
    assert 100 < found.sum() < 19_900


def test_corner_that_crosses_itself_is_inside_oddly_often():
    corners = np.array([(0, 0), (2, 2), (2, 0), (0, 2)], dtype=float)
    x, y = np.array([1.8, 0.2, 1.0, 1.0]), np.array([1.0, 1.0, 1.8, 0.2])
    assert Polygon(corners).contains(x, y).tolist() == [True, True, False, False]


def test_place_that_is_no_number_is_outside():
    box = Polygon(np.array([(0, 0), (1, 0), (1, 1), (0, 1)], dtype=float))
    x, y = np.array([0.5, np.nan, np.inf, -np.inf]), np.array([0.5, 0.5, 0.5, np.nan])
    assert box.contains(x, y).tolist() == [True, False, False, False]


@pytest.mark.parametrize("corners", [[(0, 0)], [(0, 0), (1, 1)], [(0, 0), (1, 0), (2, 0)], []])
def test_line_contains_nothing(corners):
    polygon = Polygon(np.array(corners, dtype=float).reshape(-1, 2))
    assert polygon.contains(np.array([0.0, 0.5]), np.array([0.0, 0.0])).tolist() == [False, False]
