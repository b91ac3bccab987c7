"""Contents of the figures that find faults: largest residuals, and references against the rest."""

from dataclasses import replace

import numpy as np
import pytest

from plateviz import tables
from plateviz.plots import (
    plot_largest_residuals,
    plot_reference_fields,
    plot_reference_influence,
)
from plateviz.plots.elements.style import SERIES_COLOURS
from plateviz.tables.largest_residuals import MEASUREMENT, SOURCE
from tests.plateviz.plots.drawn import plots_of, renderers_of, subtitle_of


@pytest.fixture(scope="module")
def residuals(fit_result):
    return tables.largest_residuals(fit_result)


@pytest.fixture(scope="module")
def faulty(fit_result):
    """A fit with three measurements far off, and one source."""
    rows, sources = fit_result.residuals.copy(), fit_result.sources.copy()
    rows.loc[rows.index[[3, 50, 700]], "standardised_x"] = [40.0, -9.0, 8.0]
    sources.loc[sources.index[10], "chi2"] *= 10.0
    return replace(fit_result, residuals=rows, sources=sources)


@pytest.fixture(scope="module")
def references(linear_fit):
    return tables.reference_influence(linear_fit)


@pytest.fixture(scope="module")
def between_fields(fit_result, instrument):
    return tables.reference_fields(fit_result, instrument)


def test_good_residuals_are_all_ordinary(residuals):
    for frame, kind in zip(plot_largest_residuals(residuals), (MEASUREMENT, SOURCE), strict=True):
        rows = residuals[residuals["kind"] == kind]
        assert len(frame["beyond"]) == 0
        assert np.array_equal(frame["residuals"].values("y"), rows["chi"])
        assert frame["residuals"].columns["id"].tolist() == rows["id"].tolist()
        assert not frame.y.is_log
        assert f"0 of {rows['count'].iloc[0]:,} {kind}s beyond" in subtitle_of(frame)


def test_outliers_are_strong_named_and_counted(faulty):
    measurements, sources = plot_largest_residuals(tables.largest_residuals(faulty))
    ids = faulty.residuals["source_id"].iloc[[3, 50, 700]].astype(str)
    strong = measurements["beyond"]
    assert strong.columns["id"].tolist() == ids.tolist()
    assert strong.looks["fill_color"] == SERIES_COLOURS[1]
    assert strong.looks["size"] > measurements["residuals"].looks["size"]
    assert "3 of" in subtitle_of(measurements)
    assert sources["beyond"].columns["id"].tolist() == [str(faulty.sources["source_id"].iloc[10])]
    assert "1 of" in subtitle_of(sources)


def test_far_outliers_are_on_logarithmic_axes(faulty):
    measurements, _ = plot_largest_residuals(tables.largest_residuals(faulty))
    assert measurements.x.is_log
    assert measurements.y.is_log
    assert measurements.y.limits[0] < measurements.x.limits[1] < measurements.y.limits[1]
    assert measurements.y.limits[1] > 40.0


def test_every_residual_from_the_level_up_is_within_the_frame(residuals, faulty):
    for table in (residuals, tables.largest_residuals(faulty)):
        for frame in plot_largest_residuals(table):
            x, y = (frame["residuals"].values(axis) for axis in "xy")
            assert y.max() < frame.y.limits[1]
            assert x.max() < frame.x.limits[1]
            (level,) = frame["level"].values("y")
            assert frame.y.limits[0] < level < frame.y.limits[1]


def test_more_outliers_than_rows_are_counted_as_at_least(residuals):
    rows = residuals[residuals["kind"] == MEASUREMENT].head(100).assign(is_beyond=True)
    (frame,) = plot_largest_residuals(rows)
    assert subtitle_of(frame).startswith("at least 100 of ")


def test_band_and_line_are_the_expected_sizes(residuals):
    frame = plot_largest_residuals(residuals)[0]
    rows = residuals[residuals["kind"] == MEASUREMENT]
    assert np.array_equal(frame["band"].values("y1"), rows["low"])
    assert np.array_equal(frame["band"].values("y2"), rows["high"])
    assert np.array_equal(frame["expected"].values("x"), frame["expected"].values("y"))


def test_references_are_drawn_by_pull_and_shift(references):
    (frame,) = plot_reference_influence(references)
    known, sources = references, frame["sources"]
    assert np.array_equal(sources.values("x"), known["pull"])
    assert np.array_equal(sources.values("y"), known["influence"])
    assert sources.columns["id"].tolist() == known["id"].tolist()
    assert f"{len(known)} reference sources" in subtitle_of(frame)


def test_references_without_a_pull_are_counted(references):
    table = references.copy()
    table.loc[:3, ["pull", "influence"]] = np.nan
    (frame,) = plot_reference_influence(table)
    assert len(frame["sources"]) == len(table) - 4
    assert "4 not measured well enough" in subtitle_of(frame)


def test_references_that_nothing_else_constrains_give_a_message(references):
    figure = plot_reference_influence(references.assign(pull=np.nan))
    assert figure.message == "No reference source is measured well enough"


def test_wrong_reference_is_strong_and_counted(references):
    table = references.copy()
    table.loc[0, "pull"], table.loc[0, "is_beyond"] = 9.0, True
    figure = plot_reference_influence(table)
    (frame,) = figure
    strength = frame["sources"].columns["strength"]
    sizes = frame["sources"].looks["size"].looks
    assert strength[0] == "beyond"
    assert sizes["beyond"] > sizes["expected"]
    assert f"1 beyond {table['level'].iloc[0]:.2f} σ" in subtitle_of(frame)
    (plot,) = plots_of(figure)
    (drawn,) = (one for one in renderers_of(plot) if one.name == "sources")
    assert len(drawn.data_source.data["id"]) == len(frame["sources"])
    assert frame.x.limits[1] > 9.0


def test_scatter_between_fields_is_drawn_of_both_coordinates(between_fields):
    (frame,) = plot_reference_fields(between_fields)
    for axis in ("ra", "dec"):
        rows, drawn = between_fields[between_fields["coordinate"] == axis], frame[axis]
        assert np.array_equal(drawn.values("x"), rows["expected_mas"])
        assert np.array_equal(drawn.values("y"), rows["scatter_mas"])
        assert drawn.columns["id"].tolist() == rows["id"].tolist()
        assert set(drawn.columns["strength"]) == {"expected"}
    assert np.array_equal(frame["identity"].values("x"), frame["identity"].values("y"))
    assert frame.x.label == "expected scatter (mas)"
    assert frame.y.label == "measured scatter (mas)"


def test_scatter_between_fields_has_its_chi2_in_words(between_fields):
    (frame,) = plot_reference_fields(between_fields)
    found, words = tables.reference_fields_statistics(between_fields), subtitle_of(frame)
    assert f"{found.n} reference stars in two fields or more" in words
    assert f"χ² {found.chi2:.0f}, expected {found.dof:.0f} ± {found.scatter:.0f}" in words
    assert f"0 beyond {found.limit:.1f}σ" in words
    assert f"largest {found.largest:.1f}σ" in words


def test_star_that_is_elsewhere_in_a_field_is_large_and_counted(between_fields):
    table = between_fields.copy()
    star = table["id"] == table["id"].iloc[0]
    table.loc[star, "is_beyond"] = True
    table.loc[star, "scatter_mas"] = 30.0
    (frame,) = plot_reference_fields(table)
    for axis in ("ra", "dec"):
        strength = frame[axis].columns["strength"]
        assert (np.asarray(strength) == "beyond").sum() == 1
        sizes = frame[axis].looks["size"].looks
        assert sizes["beyond"] > sizes["expected"]
    assert "1 beyond" in subtitle_of(frame)
    assert frame.y.limits[1] > 30.0


def test_single_field_gives_a_message(between_fields):
    figure = plot_reference_fields(between_fields.head(0))
    assert figure.message == "No reference star in two fields or more"
