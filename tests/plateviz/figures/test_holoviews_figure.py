"""Figures as HoloViews objects."""

import holoviews as hv
import pytest
from bokeh.models import Plot

from plateviz.figures.holoviews_figure import to_holoviews
from plateviz.figures.theme import THEMES


@pytest.mark.parametrize("theme", list(THEMES))
def test_every_kind_becomes_an_element(every_kind, theme):
    layout = to_holoviews(every_kind, theme)
    assert len(layout) == 2
    plots = list(hv.render(layout, backend="bokeh").select({"type": Plot}))
    assert {plot.title.text.split("\n")[0] for plot in plots} == {"Title", "Second"}


def test_one_frame_is_an_overlay_that_combines_with_others(framed_glyphs, marks, table):
    overlay = to_holoviews(framed_glyphs([marks()]))
    assert isinstance(overlay, hv.Overlay)
    (points,) = overlay
    assert points.dimension_values("id").tolist() == table["id"].tolist()
    assert hv.render(overlay * hv.Curve([(0.0, 1.0), (5.0, 2.0)]), backend="bokeh")


def test_unknown_theme_is_refused(every_kind):
    with pytest.raises(ValueError, match="found 'blue'"):
        to_holoviews(every_kind, "blue")
