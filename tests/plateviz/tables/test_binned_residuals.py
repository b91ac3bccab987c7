"""Residuals in bins, against known displacements and against fits by least squares."""

from dataclasses import replace

import numpy as np
import pytest

from plateviz import tables
from plateviz.tables.bin_shares import BinShares
from plateviz.tables.focal_residuals import focal_residuals
from solver.data.distortion_terms import terms
from tests.plateviz.tables.fields import (
    SIGMA_MPIX,
    left_by_exposures,
    left_by_sources,
    with_field,
    with_fitted_sources,
    without_absorption,
    without_distortion,
)

PULLS = ["pull_x", "pull_y", "pull_chi2"]


@pytest.fixture(scope="module")
def known(make_fit_result):
    """A result of 12 exposures in which only pointing, roll and scale are fitted."""
    return without_absorption(make_fit_result(6, n_sources=600)[0])


@pytest.fixture(scope="module")
def with_magnitudes(known):
    """The same with magnitudes of three quarters of the sources."""
    magnitude = np.random.default_rng(8).uniform(10.0, 15.0, len(known.sources))
    magnitude[::4] = np.nan
    return replace(known, sources=known.sources.assign(magnitude=magnitude))


def on_detectors(result, x_mpix, y_mpix=0.0):
    """Return the result with residuals along the axes of the detectors."""
    rows = result.residuals.assign(residual_x=1e-3 * x_mpix, residual_y=1e-3 * y_mpix)
    return replace(result, residuals=rows)


def noise(result, random):
    return SIGMA_MPIX * random.standard_normal((len(result.residuals), 2))


def rows_of(table, quantity):
    return table[table["quantity"] == quantity].reset_index(drop=True)


def test_sine_of_the_pixel_phase_is_found_at_its_size(known, instrument):
    phase = 2.0 * np.pi * known.residuals["nx"].to_numpy()
    table = tables.binned_residuals(on_detectors(known, 3.0 * np.sin(phase)), instrument)
    found = rows_of(table, "pixel phase in x")
    expected = 3.0 * np.sin(2.0 * np.pi * found["centre"])
    # The mean of the sine over a bin, and the share that the exposures absorb, are not exact.
    assert found["mean_x_mpix"].to_numpy() == pytest.approx(expected.to_numpy(), abs=0.35)
    assert found["pull_x"].abs().max() > 4.0
    assert np.allclose(found["mean_y_mpix"], 0.0)
    other = rows_of(table, "pixel phase in y")
    assert other["mean_x_mpix"].abs().max() < 0.6


@pytest.mark.parametrize("axis", ["x", "y"])
def test_residuals_that_grow_along_a_detector_are_found_there(known, instrument, axis):
    at = known.residuals[f"n{axis}"].to_numpy()
    shift = np.where(at > 840.0, 4.0, 0.0)
    shifted = on_detectors(known, 0.0, shift)
    found = rows_of(tables.binned_residuals(shifted, instrument), f"place along {axis}")
    assert found["pull_y"].idxmax() == 15
    assert found.loc[15, "mean_y_mpix"] >= 4.0
    assert np.allclose(found["mean_y_mpix"].head(14), 0.0)


def test_shift_of_faint_sources_is_found(with_magnitudes, instrument):
    faint = (with_magnitudes.sources["magnitude"] > 14.0).to_numpy()
    source = focal_residuals(with_magnitudes, instrument).source
    shifted = on_detectors(with_magnitudes, 2.0 * faint[source])
    found = rows_of(tables.binned_residuals(shifted, instrument), "magnitude")
    assert (found["mean_x_mpix"][found["centre"] > 14.2] > 1.9).all()
    assert np.allclose(found["mean_x_mpix"][found["centre"] < 13.7], 0.0)
    measured = np.isfinite(with_magnitudes.sources["magnitude"].to_numpy())[source]
    assert found["n"].sum() == measured.sum()


def test_understated_errors_of_faint_sources_raise_their_scatter(with_magnitudes, instrument):
    random = np.random.default_rng(1)
    magnitude = with_magnitudes.sources["magnitude"].to_numpy()
    faint = (magnitude > 14.0)[focal_residuals(with_magnitudes, instrument).source]
    x, y = noise(with_magnitudes, random).T * np.where(faint, 1.3, 1.0)
    found = rows_of(
        tables.binned_residuals(on_detectors(with_magnitudes, x, y), instrument), "magnitude"
    )
    of_faint = found["centre"] > 14.2
    assert found.loc[of_faint, "chi2_per_dof"].mean() == pytest.approx(1.69, abs=0.2)
    assert (found.loc[of_faint, "pull_chi2"] > 5.0).all()
    assert found.loc[found["centre"] < 13.7, "chi2_per_dof"].mean() == pytest.approx(1.0, abs=0.08)


def test_noise_has_the_stated_scatter(with_magnitudes, instrument):
    random, squares = np.random.default_rng(2), []
    for _ in range(12):
        field = left_by_exposures(with_magnitudes, noise(with_magnitudes, random))
        table = tables.binned_residuals(with_field(with_magnitudes, field), instrument)
        squares.append(np.square(table.set_index("quantity")[PULLS]).groupby(level=0).mean())
    means = sum(squares) / len(squares)
    # Twelve times sixteen values each, of which those of a place follow exposures less closely.
    assert means.to_numpy() == pytest.approx(1.0, abs=0.35)
    assert means.to_numpy().mean() == pytest.approx(1.0, abs=0.1)


def test_noise_has_the_stated_scatter_when_sources_are_fitted(with_magnitudes, instrument):
    fitted, random, squares = with_fitted_sources(with_magnitudes), np.random.default_rng(4), []
    for _ in range(8):
        field = noise(fitted, random)
        # Both fits at once, by turns.
        for _ in range(5):
            field = left_by_sources(fitted, left_by_exposures(fitted, field))
        table = tables.binned_residuals(with_field(fitted, field), instrument)
        squares.append(np.square(table[PULLS].to_numpy()).mean(axis=0))
    assert np.mean(squares, axis=0) == pytest.approx(1.0, abs=0.2)


@pytest.mark.parametrize("quantity", ["time", "faintness", "pixel phase", "place"])
def test_share_that_is_left_is_that_of_least_squares(with_magnitudes, instrument, quantity):
    fitted = with_fitted_sources(with_magnitudes)
    found = focal_residuals(fitted, instrument)
    at = fitted.residuals["nx"].to_numpy()
    inside = {
        "time": found.exposure < 2,
        "faintness": (fitted.sources["magnitude"] > 14.0).to_numpy()[found.source],
        "pixel phase": at % 1.0 < 0.1,
        "place": at > 600.0,
    }[quantity]
    turn = np.radians(fitted.values_on("det")["detector_rotation"].to_numpy())[found.detector]
    share = BinShares(fitted, found, turn)((~inside).astype(np.int64), 1)[0]
    for axis, unit in enumerate([(np.cos(turn), -np.sin(turn)), (np.sin(turn), np.cos(turn))]):
        left = field = inside[:, None] * np.stack(unit, axis=-1)
        for _ in range(20):
            left = left_by_sources(fitted, left_by_exposures(fitted, left))
        assert share[axis] == pytest.approx((left * field).sum() / inside.sum(), abs=0.06)
    assert share.max() < 0.97


@pytest.mark.parametrize(("degrees", "axis"), [((5, 0), 0), ((0, 5), 1), ((2, 1), 0), ((1, 2), 1)])
def test_free_term_of_the_distortion_takes_from_the_bins_that_it_changes_in(
    known, instrument, degrees, axis
):
    """A polynomial of higher degree in x than in y differs more between bins along x."""
    rows = known.calibration
    is_free = (rows["group"] == "distortion_x") & (rows["element"] == terms(5).index(degrees))
    assert is_free.sum() == 1
    freed = replace(known, calibration=rows.assign(prior_share=np.where(is_free, 0.0, 1.0)))
    found = focal_residuals(freed, instrument)
    turn = np.radians(freed.values_on("det")["detector_rotation"].to_numpy())[found.detector]
    taken = []
    for places in found.at.T:
        edges = np.quantile(places, np.linspace(0.0, 1.0, 17)[1:-1])
        cells = np.searchsorted(edges, places)
        both = [BinShares(one, found, turn)(cells, 16).sum() for one in (known, freed)]
        taken.append(both[0] - both[1])
    assert taken[axis] > 1.5 * max(taken[1 - axis], 0.0)


def test_orbital_phase_is_there_beyond_one_period(known, instrument):
    short = tables.binned_residuals(known, instrument)
    assert "orbital phase" not in set(short["quantity"])
    minutes = np.linspace(0.0, 3.0 * known.settings.breathing_period, len(known.exposures))
    turns = known.exposures.assign(obstime=60_000.0 + minutes / 1440.0)
    found = tables.binned_residuals(replace(known, exposures=turns), instrument)
    phase = rows_of(found, "orbital phase")
    assert phase["centre"].between(0.0, 1.0).all()
    assert phase["n"].sum() == len(known.residuals)


def test_bins_of_time_hold_all_measurements_in_order(known, instrument):
    found = rows_of(tables.binned_residuals(known, instrument), "time")
    assert found["n"].sum() == len(known.residuals)
    assert found["centre"].is_monotonic_increasing
    # The fixture takes an exposure every 0.002 days.
    assert np.allclose(found["centre"], 2.88 * np.arange(len(found)), atol=1e-3)


def test_without_magnitudes_there_are_no_bins_of_magnitude(known, instrument):
    unknown = replace(known, sources=known.sources.assign(magnitude=np.nan))
    assert list(tables.binned_residuals(unknown, instrument)["quantity"].unique()) == [
        "time",
        "place along x",
        "place along y",
        "pixel phase in x",
        "pixel phase in y",
    ]


@pytest.mark.parametrize("order", [0, 1])
def test_fit_without_distortion_terms_has_the_bins_of_any_other(known, instrument, order):
    table = tables.binned_residuals(known, instrument)
    found = tables.binned_residuals(without_distortion(known, order), instrument)
    # In `known` the priors hold all terms, so that they absorb nothing.
    assert np.allclose(found[PULLS], table[PULLS])


def test_bins_of_few_measurements_have_no_row(known, instrument):
    few = replace(known, residuals=known.residuals.head(15))
    assert tables.binned_residuals(few, instrument).empty


def test_summary_counts_what_is_beyond_two_sigma(known, instrument):
    table = tables.binned_residuals(known, instrument).assign(pull_x=1.0, pull_y=-2.5, pull_chi2=0)
    table.loc[0, "pull_x"] = np.nan
    found = tables.bin_statistics(table)
    assert found.values == 3 * len(table) - 1
    assert found.beyond == len(table)
    assert found.expected == pytest.approx(0.0455 * found.values)
    assert (found.largest, found.of_largest) == (2.5, "mean y")
    assert found.limit > 3.5
