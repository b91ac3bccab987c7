"""Figures of the eigenmodes and weak directions: marks, labels and scales."""

from dataclasses import replace

import numpy as np
import pytest

from plateviz import plots, tables
from plateviz.figures.bokeh_figure import BokehFigure
from plateviz.figures.resized import resized
from plateviz.plots.diagnostic import Chosen
from plateviz.plots.gallery import diagnostics
from plateviz.plots.weak_directions.eigenmode_groups import _amount
from tests.plateviz.plots.drawn import shafts_of, texts_of

NAMES = [
    "eigenmode-spectrum",
    "weak-directions",
    "eigenmode-groups",
    "eigenmode-shifts",
    "prior-shares",
]


def of_kind(frame, kind):
    return [glyphs for glyphs in frame.glyphs if glyphs.kind == kind]


def test_weak_directions_are_marked_in_the_spectrum(fit_result):
    frame = plots.plot_eigenmode_spectrum(tables.eigenmode_spectrum(fit_result))[0]
    rest, weak = of_kind(frame, "points")
    assert weak.columns["mode"].tolist() == [1, 2, 3]
    assert len(rest) + len(weak) == len(fit_result.eigenmodes)


def test_both_panels_of_the_spectrum_have_all_eigenmodes(fit_result):
    figure = plots.plot_eigenmode_spectrum(tables.eigenmode_spectrum(fit_result))
    assert len(figure) == 2
    for frame in figure:
        assert sum(map(len, of_kind(frame, "points"))) == len(fit_result.eigenmodes)


def test_every_weak_direction_is_named_above_its_bar_with_what_decides_it(fit_result):
    labels = texts_of(plots.plot_eigenmode_deciders(tables.eigenmode_deciders(fit_result))[0])
    assert labels == [
        "prior of detector x 100 %: common detector x with common pointing RA",
        "reference sources 100 %: common position angle",
        "prior of detector x 50 %, measurements 25 %, reference sources 25 %: common Dec",
    ]


def test_legend_has_no_entry_without_a_share(fit_result):
    frame = plots.plot_eigenmode_deciders(tables.eigenmode_deciders(fit_result))[0]
    labels = {glyphs.label for glyphs in frame.glyphs if glyphs.label}
    assert frame.legend_columns
    assert labels == {"measurements", "reference sources", "priors of the calibration"}


def test_bars_are_as_long_as_the_shares(fit_result):
    table = tables.eigenmode_deciders(fit_result)
    bars = of_kind(plots.plot_eigenmode_deciders(table)[0], "rectangles")
    length = sum((one.values("right") - one.values("left")).sum() for one in bars)
    assert length == pytest.approx(table["share"].sum())


def test_only_cells_with_a_large_share_have_labels(fit_result):
    table = tables.eigenmode_groups(fit_result)
    labels = texts_of(plots.plot_eigenmode_groups(table)[0])
    labelled = int((table["share"] >= 0.005).sum())
    assert len(labels) == 2 * labelled + table["mode"].nunique()


@pytest.mark.parametrize(
    ("move", "unit", "text"),
    [
        (120.4, "arcsec", "120 arcsec"),
        (1.9, "arcsec", "1.9 arcsec"),
        (1.1e-4, "arcsec", "110 µas"),
        (0.0018, "µm", "1.8 nm"),
        (4e-10, "µm", "0.00040 pm"),
        (0.0, "µm", "0 µm"),
    ],
)
def test_moves_are_given_in_a_suitable_unit(move, unit, text):
    assert _amount(move, unit) == text


def test_shifts_of_all_directions_have_one_scale(fit_result):
    table = tables.eigenmode_shifts(fit_result)
    stretches = []
    for frame, mode in zip(plots.plot_eigenmode_shifts(table), (1, 2, 3), strict=True):
        shafts = shafts_of(frame)
        rows = table[table["mode"] == mode]
        drawn = np.hypot(shafts["x1"] - shafts["x0"], shafts["y1"] - shafts["y0"]).mean()
        stretches.append(drawn / np.hypot(rows["u"], rows["v"]).mean())
    assert np.allclose(stretches, stretches[0], rtol=1e-3)


def test_key_of_the_shifts_has_the_stated_length(fit_result):
    frame = plots.plot_eigenmode_shifts(tables.eigenmode_shifts(fit_result))[0]
    shafts = shafts_of(frame)
    (text,) = texts_of(frame)
    number, unit = text.split()
    scale = (shafts["x1"] - shafts["x0"]).mean() / 1e-4
    drawn = abs(frame["key"].values("x1")[0] - frame["key"].values("x0")[0]) / abs(scale)
    assert drawn == pytest.approx(float(number) * {"µas": 1e-3, "mas": 1.0}[unit], rel=1e-3)


def test_few_sources_have_an_arrow_each(fit_result):
    table = tables.eigenmode_shifts(fit_result).groupby("mode").head(50)
    tails = plots.plot_eigenmode_shifts(table)[0]["tails"]
    assert tails.columns["id"].tolist() == table["id"].head(50).tolist()


def test_every_parameter_has_a_point_at_its_prior_share(fit_result):
    frame = plots.plot_prior_shares(tables.prior_shares(fit_result))[0]
    (points,) = of_kind(frame, "points")
    assert len(points) == len(fit_result.calibration)
    assert texts_of(frame).count("flat") == 1


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("theme", ["light", "dark"])
def test_diagnostics_are_in_the_gallery(fit_result, instrument, name, theme):
    (diagnostic,) = [d for d in diagnostics() if d.name == name]
    figure = diagnostic.plot(Chosen(fit_result, instrument))
    assert figure.message is None
    assert len(BokehFigure(figure, theme).model.children) == len(figure)


@pytest.mark.parametrize("name", ["weak-directions", "eigenmode-groups", "prior-shares"])
def test_rows_of_texts_have_room_in_a_small_window(fit_result, instrument, name):
    (diagnostic,) = [d for d in diagnostics() if d.name == name]
    figure = diagnostic.plot(Chosen(fit_result, instrument))
    (frame,) = resized(figure, 508, diagnostic.least_height - 8, corner=76)
    assert frame.frame_height >= 12 * len(frame.y.ticks)


@pytest.mark.parametrize("name", NAMES[:-1])
def test_result_without_eigenmodes_is_drawn_as_a_message(fit_result, instrument, name):
    old = replace(fit_result, eigenmodes=None, mode_parameters=None, mode_shifts=None)
    (diagnostic,) = [d for d in diagnostics() if d.name == name]
    assert diagnostic.plot(Chosen(old, instrument)).message.startswith("No ")
