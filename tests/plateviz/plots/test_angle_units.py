"""Angles of every figure in one unit that a person has chosen."""

import re

import numpy as np
import pytest

from plateviz.figures.figure import Axis, Figure, Ramp, framed
from plateviz.figures.figure_tables import figure_tables
from plateviz.figures.glyphs import image, points
from plateviz.plots.elements.angle_units import AngleUnits, mas_per_pixel
from solver.data.instrument import MINI_MOCK
from tests.plateviz.plots.test_every_plot import with_every_plot

PIXEL = mas_per_pixel(MINI_MOCK)
OTHERS = {"mas": "µas|mpix", "µas": "mas|mpix", "mpix": "mas|µas"}
with_every_unit = pytest.mark.parametrize("unit", OTHERS)


def words(figure):
    """Every text of a figure that may have a unit."""
    for frame in figure:
        yield from (frame.title, frame.subtitle, frame.x.label, frame.y.label)
        for glyphs in frame.glyphs:
            yield glyphs.label
            yield from (text for _, text in glyphs.hover)
            yield from (look.label or "" for look in glyphs.looks.values() if type(look) is Ramp)
            if glyphs.kind == "texts":
                yield from map(str, glyphs.values("text"))


def numbers(figure):
    """Every number that is drawn, those of the axes among them."""
    for frame in figure:
        yield np.array([*frame.x.limits, *frame.y.limits])
        for glyphs in frame.glyphs:
            for values in glyphs.columns.values():
                if values.dtype.kind in "fi":
                    yield values.astype(float)


@with_every_plot
@with_every_unit
def test_every_angle_of_a_figure_has_the_unit(figures, name, unit):
    figure = AngleUnits(unit, PIXEL).figure(Figure(tuple(figures(name))))
    left = re.compile(rf"\b({OTHERS[unit]})\b(?!²)")
    # Names of columns in a hover are not shown.
    assert [text for text in words(figure) if left.search(re.sub(r"@\{\w+\}", "", text))] == []


@with_every_plot
def test_figure_in_another_unit_and_back_is_the_same(figures, name):
    first, second = AngleUnits("mas", PIXEL), AngleUnits("mpix", PIXEL)
    figure = first.figure(Figure(tuple(figures(name))))
    again = first.figure(second.figure(figure))
    assert [text.label for frame in again for text in (frame.x, frame.y)] == [
        text.label for frame in figure for text in (frame.x, frame.y)
    ]
    for one, two in zip(numbers(figure), numbers(again), strict=True):
        np.testing.assert_allclose(one, two, rtol=1e-12)


_OF_UNIT = re.compile("_(mas|uas|mpix)$")


def with_units(figure):
    """Yield table, name without unit -> the angles in mas of each column in such a unit."""
    in_mas = {"mas": 1.0, "uas": 1e-3, "mpix": PIXEL / 1e3}
    for table, columns in figure_tables(figure).items():
        for name in columns.colnames:
            unit = str(columns[name].unit)
            if unit in in_mas:
                values = np.asarray(columns[name], float)
                yield (table, _OF_UNIT.sub("", name)), values * in_mas[unit]


@with_every_plot
@with_every_unit
def test_saved_numbers_are_in_the_unit_of_their_columns(figures, name, unit):
    figure = Figure(tuple(figures(name)))
    plain = {}
    for key, values in with_units(figure):
        plain.setdefault(key, []).append(values)
    for key, values in with_units(AngleUnits(unit, PIXEL).figure(figure)):
        assert any(np.allclose(values, one, rtol=1e-9, equal_nan=True) for one in plain[key]), key


def test_saved_column_has_the_chosen_unit_in_its_name_once():
    table = {"x": [1.0], "shift_mas": [2.0], "shift_mpix": [2.0e3 / PIXEL]}
    hover = [("shift", "@{shift_mpix}{0.0} mpix = @{shift_mas}{0.00} mas")]
    marks = points(table, "x", "shift_mas", name="marks", color="mark", hover=hover)
    axes = {"x": Axis("x (mm)", (0.0, 1.0)), "y": Axis("shift (mas)", (0.0, 3.0))}
    figure = framed([marks], title="Shifts", **axes, width=200, height=100)
    saved = figure_tables(AngleUnits("µas", PIXEL).figure(figure))["marks"]
    assert saved.colnames == ["x", "shift_uas"]
    assert saved["shift_uas"][0] == pytest.approx(2000.0)
    assert saved["shift_uas"].description == "shift (µas)"
    assert [saved[name].unit for name in saved.colnames] == ["mm", "uas"]


def test_coordinates_limits_hovers_and_words_are_scaled_together():
    table = {"x": [1.0, 2.0], "y": [3.0, 4.0], "error": [0.5, 0.25], "n": [7, 8], "u": "mas"}
    hover = [
        ("error", "@{error}{0.0000} ± @{error}{0.00} mas"),
        ("y", "@{y}{0.000} @{u}"),
        ("n", "@{n}"),
        ("twice", "@{error}{0.0} mas = @{n} mpix"),
    ]
    marks = points(
        {**table, "u": ["mas", "mas"]}, "x", "y", name="marks", color="mark", hover=hover
    )
    figure = framed(
        [marks],
        title="Errors below 12 mas",
        subtitle="7 sources, mean −0.250, 0.125 mas; key: 5 µm = 212 mas; area 3 mpix² = (85 µas)²",
        x=Axis("time (yr)", (0.0, 2.0)),
        y=Axis("offset (mas, North up)", (2.0, 5.0)),
        width=300,
    )
    (frame,) = AngleUnits("µas", PIXEL).figure(figure)
    assert frame.y == Axis("offset (µas, North up)", (2000.0, 5000.0))
    assert frame.x == figure[0].x
    assert frame.title == "Errors below 12,000 µas"
    assert frame.subtitle == (
        "7 sources, mean −250, 125 µas; key: 5 µm = 212,000 µas; area 3 mpix² = (85 µas)²"
    )
    columns = frame["marks"].columns
    assert columns["x"].tolist() == [1.0, 2.0]
    assert columns["y"].tolist() == [3000.0, 4000.0]
    assert columns["error"].tolist() == [500.0, 250.0]
    assert columns["n"].tolist() != [7000, 8000]
    assert [text for _, text in frame["marks"].hover] == [
        "@{error}{0.0} ± @{error}{0} µas",
        "@{y}{0} µas",
        "@{n}",
        "@{error}{0} µas",
    ]


def test_place_of_the_pointer_has_the_unit_of_the_axis():
    cells = image(
        np.ones((2, 2)),
        (0.0, 1.0),
        (0.0, 1.0),
        name="cells",
        ramp=Ramp("value", "count", (0.0, 1.0)),
        hover=[("offset", "$x{0.00} mas"), ("sources", "$y{0}")],
    )
    figure = framed(
        [cells], title="", x=Axis("offset (mas)", (0.0, 1.0)), y=Axis("n", (0.0, 1.0)), width=100
    )
    (frame,) = AngleUnits("µas", PIXEL).figure(figure)
    assert frame.x.limits == (0.0, 1000.0)
    assert list(frame.glyphs[0].hover) == [("offset", "$x{0.00} µas"), ("sources", "$y{0}")]
    assert AngleUnits("µas", PIXEL).of_axes(figure.frames[0]) == (1000.0, 1.0)


def test_colours_of_an_image_are_those_of_the_same_cells():
    ramp = Ramp("mean", "difference", (-3.0, 3.0), label="mpix")
    cells = image(np.eye(2), (0.0, 2.0), (0.0, 2.0), name="cells", ramp=ramp)
    axes = {"x": Axis("x (mm)", (0.0, 2.0)), "y": Axis("y (mm)", (0.0, 2.0))}
    (frame,) = AngleUnits("mas", 500.0).figure(framed([cells], title="Cells", width=200, **axes))
    found = frame["cells"]
    assert found.values("image")[0].tolist() == [[0.5, 0.0], [0.0, 0.5]]
    assert found.looks["color"].limits == (-1.5, 1.5)
    assert found.looks["color"].label == "mas"
    assert found.values("dw").tolist() == [2.0]


@pytest.mark.parametrize(
    ("text", "shown"),
    [
        ("85 µas", "0.085 mas"),
        ("0.123 ± 0.004 µas", "0.000123 ± 0.000004 mas"),
        ("1,500 µas/yr", "1.500 mas/yr"),
        ("3 orbits, 2 massive stars", "3 orbits, 2 massive stars"),
        ("2.0 mpix = 1.1 mas", "1.0 mas"),
        ("-5 mpix", "−2.5 mas"),
    ],
)
def test_texts_keep_their_digits(text, shown):
    assert AngleUnits("mas", 500.0).text(text) == shown


def test_pixel_of_the_mini_mock():
    # 10 µm at 4.86 m, from the paper.
    assert mas_per_pixel(MINI_MOCK) == pytest.approx(424.4, abs=0.1)
