"""E and B parts of the correlation, against pairs counted one by one and fields that are known."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from scipy.special import j0

from plateviz import tables
from plateviz.tables.chance import largest_by_chance
from plateviz.tables.focal_residuals import focal_residuals
from tests.plateviz.tables.fields import (
    SIGMA_MPIX,
    left_by_exposures,
    moves_of,
    with_field,
    without_absorption,
)

HALF_MM, CELLS = 20.7, 80
EDGE_MM = 2.0 * HALF_MM / CELLS
WAVENUMBER = 2.0 * np.pi / 9.0


@pytest.fixture(scope="module")
def known(make_fit_result):
    """Some 500 measurements in each of 12 exposures; nothing but the exposures is fitted."""
    return without_absorption(make_fit_result(7, n_sources=1500)[0])


@pytest.fixture(scope="module")
def on_cells(make_fit_result):
    """A sparse result whose measurements are at the centres of the table's grid."""
    result = without_absorption(make_fit_result(8, n_sources=300)[0])
    rows = result.residuals.copy()
    for name in ("focal_x", "focal_y"):
        cell = np.floor((rows[name] / 1000.0 + HALF_MM) / EDGE_MM)
        rows[name] = 1000.0 * ((cell + 0.5) * EDGE_MM - HALF_MM)
    return replace(result, residuals=rows)


def waves(found, random, *, is_curl):
    """Return a field of waves of one length in all directions, other ones in each exposure."""
    field = np.zeros((len(found), 2))
    for exposure in np.unique(found.exposure):
        on = found.exposure == exposure
        for angle in random.uniform(0.0, 2.0 * np.pi, 60):
            along = np.array([np.cos(angle), np.sin(angle)])
            phase = WAVENUMBER * found.at[on] @ along + random.uniform(0.0, 2.0 * np.pi)
            towards = np.array([-along[1], along[0]]) if is_curl else along
            field[on] += np.outer(np.sin(phase), towards)
    return field / np.sqrt(np.mean(np.sum(field**2, axis=1)))


def counted(result, instrument, table):
    """Return xi_+ and xi_- of every bin from all pairs, with what the exposures absorb added."""
    found = focal_residuals(result, instrument)
    sums = np.zeros((3, len(table)))
    for exposure in np.unique(found.exposure):
        on = found.exposure == exposure
        w, place = found.vector[on] @ (1.0, 1.0j), found.at[on] @ (1.0, 1.0j)
        design = moves_of(found.at[on])
        absorbed = design @ np.linalg.solve(design.T @ design, design.T)
        absorbed = absorbed.reshape(on.sum(), 2, on.sum(), 2).trace(axis1=1, axis2=3)
        one, two = np.triu_indices(on.sum(), 1)
        # Whole cells, since a rounding error moves some pairs across the edge of a bin.
        between = np.round((place[two] - place[one]) / EDGE_MM) * EDGE_MM
        number = np.digitize(np.abs(between), [*table["low_mm"], table["high_mm"].iloc[-1]]) - 1
        inside = (number >= 0) & (number < len(table))
        plus = (w[one] * w[two].conj()).real + SIGMA_MPIX**2 * absorbed[one, two]
        minus = (w[one] * w[two] * np.exp(-2j * np.angle(between))).real
        for row, values in enumerate((np.ones(len(one)), plus, minus)):
            sums[row] += np.bincount(number[inside], values[inside], minlength=len(table))
    return sums[0], sums[1] / sums[0], sums[2] / sums[0]


def test_sums_on_the_grid_are_those_over_all_pairs(on_cells, instrument):
    table = tables.residual_correlation(on_cells, instrument)
    assert len(table) == 12
    pairs, plus, minus = counted(on_cells, instrument, table)
    assert np.allclose(table["xi_plus"], plus, atol=1e-3 * np.abs(plus).max())
    assert np.allclose(table["xi_minus"], minus, atol=1e-3 * np.abs(minus).max())
    # The product of two vectors of noise has a variance of 2 sigma^4.
    sigma = np.sqrt(2.0) * SIGMA_MPIX**2 / np.sqrt(pairs)
    assert np.allclose(table["sigma_xi"], sigma, rtol=1e-4)


@pytest.mark.parametrize(("is_curl", "own", "other"), [(False, "e", "b"), (True, "b", "e")])
def test_gradients_are_in_the_e_part_and_curls_in_the_b_part(
    known, instrument, is_curl, own, other
):
    found = focal_residuals(known, instrument)
    field = 50.0 * waves(found, np.random.default_rng(5), is_curl=is_curl)
    table = tables.residual_correlation(with_field(known, field), instrument)
    square = 50.0**2
    # Waves of one length and all directions are correlated as J0, which wide bins average.
    narrow = table["separation_mm"] < 6.0
    expected = square * j0(WAVENUMBER * table["separation_mm"])
    assert np.allclose(table.loc[narrow, own], expected[narrow], atol=0.05 * square)
    assert table[own].iloc[0] > 0.7 * square
    assert np.abs(table[other]).max() < 0.1 * square


def test_field_without_preferred_direction_has_equal_parts(known, instrument):
    found, random = focal_residuals(known, instrument), np.random.default_rng(6)
    both = [waves(found, random, is_curl=is_curl) for is_curl in (False, True)]
    field = 50.0 * (both[0] + both[1]) / np.sqrt(2.0)
    table = tables.residual_correlation(with_field(known, field), instrument)
    assert np.allclose(table["e"], table["b"], atol=0.1 * 50.0**2)
    assert table["e"].iloc[0] == pytest.approx(0.5 * 50.0**2, rel=0.35)


def test_noise_has_the_stated_scatter_about_zero(known, instrument):
    random, found = np.random.default_rng(7), []
    for _ in range(12):
        noise = SIGMA_MPIX * random.standard_normal((len(known.residuals), 2))
        left = with_field(known, left_by_exposures(known, noise))
        found.append(tables.residual_correlation(left, instrument))
    of_all = pd.concat(found)
    for name in ("pull_e", "pull_b"):
        assert np.sqrt(np.mean(of_all[name] ** 2)) == pytest.approx(1.0, abs=0.2)
    pulls = of_all["xi_plus"] / of_all["sigma_xi"]
    assert np.abs(pulls.mean()) < 4.0 / np.sqrt(len(pulls))
    assert np.sqrt(np.mean(pulls**2)) == pytest.approx(1.0, abs=4.0 / np.sqrt(2 * len(pulls)))


def test_what_the_exposures_absorb_is_seen_in_the_noise(known, instrument):
    """The part that the table adds is as large as a sigma, so that the test above is one of it."""
    none = with_field(known, np.zeros((len(known.residuals), 2)))
    table = tables.residual_correlation(none, instrument)
    assert (table["xi_plus"] / table["sigma_xi"]).mean() > 0.7
    # A roll and a change of scale cancel in the other one.
    assert table["xi_minus"].abs().max() < 1e-3 * table["xi_plus"].max()


def test_residuals_are_divided_by_the_share_that_the_fit_leaves(known, instrument):
    half = replace(known, residuals=known.residuals.assign(leverage=1.0))
    whole, left = (tables.residual_correlation(one, instrument) for one in (known, half))
    assert np.allclose(left["xi_minus"], 4.0 * whole["xi_minus"], rtol=1e-3)
    # By another root of two, because products of the same sources are correlated.
    assert np.allclose(left["sigma"], np.sqrt(8.0) * whole["sigma"], rtol=1e-3)


def test_a_single_measurement_in_each_exposure_has_no_pairs(known, instrument):
    rows = known.residuals.drop_duplicates(["field_id", "plate_id"])
    assert tables.residual_correlation(replace(known, residuals=rows), instrument).empty


def test_separations_are_given_on_the_sky(known, instrument):
    table = tables.residual_correlation(known, instrument)
    arcmin = np.degrees(table["separation_mm"] * 1000.0 / 4.86e6) * 60.0
    assert np.allclose(table["separation_arcmin"], arcmin, rtol=1e-4)
    assert table["separation_mm"].between(table["low_mm"], table["high_mm"]).all()


def test_summary_has_the_largest_parts_and_their_limit(known, instrument):
    table = tables.residual_correlation(known, instrument).assign(pull_e=1.0, pull_b=-0.5)
    table.loc[2, "pull_e"] = -6.0
    found = tables.correlation_statistics(table)
    assert (found.largest_e, found.largest_b) == (6.0, 0.5)
    assert found.limit == pytest.approx(largest_by_chance(24))
    assert found.least_sigma_mas == pytest.approx(0.4244 * np.sqrt(table["sigma"].min()), rel=1e-3)
