"""Figures as plain values."""

import numpy as np
import pytest

from plateviz.figures.figure import message, side_by_side
from plateviz.figures.glyphs import ellipse, points


def test_columns_are_those_of_coordinates_looks_hover_and_legend(marks):
    assert list(marks().columns) == ["x", "y", "kind", "id"]


def test_columns_to_keep_are_kept(table):
    kept = points(table, "x", "y", name="sources", color="mark", keep=["id"])
    assert kept.columns["id"].tolist() == table["id"].tolist()


def test_missing_column_is_an_error(table):
    with pytest.raises(KeyError, match="absent"):
        points(table, "x", "y", name="sources", color="mark", hover=[("v", "@{absent}{0.0}")])


def test_glyphs_are_found_by_name(every_kind, table):
    sources = every_kind[0]["sources"]
    assert len(sources) == len(table)
    assert sources.values("y")[:2].tolist() == [2.0, 1.0]
    with pytest.raises(KeyError):
        every_kind[0]["absent"]


def test_frame_without_height_has_equal_scales(framed_glyphs, marks):
    (frame,) = framed_glyphs([marks()])
    assert frame.frame_height == 200 * 4.0 / 5.0
    (frame,) = framed_glyphs([marks()], height=77)
    assert frame.frame_height == 77


def test_message_is_told_from_data(framed_glyphs, marks):
    assert message("Title", "No sources").message == "No sources"
    assert framed_glyphs([marks()]).message is None
    both = side_by_side([framed_glyphs([marks()]), message("T", "None")], columns=2)
    assert both.message is None


def test_ellipse_is_one_sigma_of_the_covariance():
    covariance = np.array([[4.0, 1.2], [1.2, 1.0]])
    drawn = ellipse(covariance, name="ellipse", scale=2.0)
    points = np.array([drawn.values("x"), drawn.values("y")])
    distances = np.einsum("in,ij,jn->n", points, np.linalg.inv(covariance), points)
    assert np.allclose(distances, 4.0)
