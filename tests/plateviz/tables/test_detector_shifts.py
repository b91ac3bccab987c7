"""Shifts of detectors over time, against fits of pointing, roll and scale by least squares."""

from dataclasses import replace

import numpy as np
import pytest

from plateviz import tables
from plateviz.tables.focal_residuals import focal_residuals
from tests.plateviz.tables.fields import (
    SIGMA_MPIX,
    left_by_exposures,
    left_by_sources,
    with_field,
    with_fitted_sources,
    without_absorption,
)


@pytest.fixture(scope="module")
def known(make_fit_result):
    """A result of 12 exposures in which only pointing, roll and scale are fitted."""
    return without_absorption(make_fit_result(6, n_sources=600)[0])


@pytest.mark.parametrize("moved", [(4.0, 0.0), (-1.0, 2.5)])
def test_move_of_a_detector_in_one_exposure_is_found_at_its_size(known, instrument, moved):
    found = focal_residuals(known, instrument)
    inside = (found.exposure == 7) & (found.detector == 2)
    left = left_by_exposures(known, np.outer(inside, moved))
    table = tables.detector_shifts(with_field(known, left), instrument, together=[1])
    is_then = table["exposure"] == "field 2, exposure 1"
    row = table[is_then & (table["detector_id"] == 2)]
    # Roll and scale pass a little of a shift along one axis on to the other.
    assert row["shift_x_mpix"].item() == pytest.approx(moved[0], abs=0.1)
    assert row["shift_y_mpix"].item() == pytest.approx(moved[1], abs=0.1)
    assert np.allclose(table.loc[~is_then, ["shift_x_mpix", "shift_y_mpix"]], 0.0, atol=1e-9)
    # The mean of what is left of it is clearly smaller.
    assert np.abs(left[inside].mean(axis=0)).max() < 0.8 * np.abs(moved).max()


def test_noise_has_the_stated_scatter(known, instrument):
    random, pulls = np.random.default_rng(3), []
    for _ in range(10):
        noise = SIGMA_MPIX * random.standard_normal((len(known.residuals), 2))
        left = with_field(known, left_by_exposures(known, noise))
        pulls.append(tables.detector_shifts(left, instrument, together=[1]))
    squares = np.square([one[["pull_x", "pull_y"]] for one in pulls])
    # Half of the eight shifts of an exposure are independent.
    assert squares.mean() == pytest.approx(1.0, abs=4.0 * np.sqrt(2.0 / (0.5 * squares.size)))


def test_noise_of_groups_has_the_stated_scatter_when_sources_are_fitted(known, instrument):
    fitted, random, squares = with_fitted_sources(known), np.random.default_rng(4), []
    for _ in range(8):
        noise = SIGMA_MPIX * random.standard_normal((len(known.residuals), 2))
        left = noise
        # Both fits at once, by turns.
        for _ in range(5):
            left = left_by_sources(fitted, left_by_exposures(fitted, left))
        table = tables.detector_shifts(with_field(fitted, left), instrument, together=[2])
        squares.append(np.square(table[["pull_x", "pull_y"]].to_numpy()).mean())
    assert np.mean(squares) == pytest.approx(1.0, abs=0.2)


def test_rows_are_in_order_of_time_in_minutes(known, instrument):
    late = known.exposures.assign(obstime=known.exposures["obstime"].to_numpy()[::-1])
    table = tables.detector_shifts(replace(known, exposures=late), instrument)
    single = table[table["together"] == 1]
    # The fixture takes an exposure every 0.002 days.
    assert np.allclose(single["minutes"].unique(), 2.88 * np.arange(12), atol=1e-4)
    assert single["exposure"].iloc[0] == "field 3, exposure 2"
    assert single["n"].sum() == len(known.residuals)


@pytest.mark.parametrize(("together", "groups"), [(1, 12), (2, 8), (3, 4), (6, 4)])
def test_groups_are_within_one_field(known, instrument, together, groups):
    table = tables.detector_shifts(known, instrument, together=[together])
    assert len(table) == groups * len(instrument.detectors)
    assert table["n"].sum() == len(known.residuals)
    for number in range(4):
        first = table[table["exposure"] == f"field {number}, exposure 0"]
        wanted = known.residuals.query(f"field_id == {number} and plate_id < {together}")
        assert first["n"].sum() == len(wanted)


def test_shift_of_a_single_detector_is_absorbed(known, instrument):
    one = replace(instrument, detectors=instrument.detectors[:1])
    alone = replace(known, residuals=known.residuals.query("detector_id == 0"))
    assert tables.detector_shifts(alone, one).empty


def test_detector_without_measurements_has_no_row(known, instrument):
    gone = known.residuals.query("not (detector_id == 1 and field_id == 2)")
    table = tables.detector_shifts(replace(known, residuals=gone), instrument, together=[1])
    names = table.loc[table["detector_id"] == 1, "exposure"]
    assert len(names) == 9
    assert not names.str.startswith("field 2").any()


def test_summary_counts_shifts_beyond_two_sigma(known, instrument):
    table = tables.detector_shifts(known, instrument, together=[1]).assign(pull_x=1.0, pull_y=-2.5)
    found = tables.shift_statistics(table)
    assert found.values == 2 * len(table)
    assert found.beyond == len(table)
    assert found.expected == pytest.approx(0.0455 * found.values)
    assert found.largest == 2.5
    assert found.limit > 3.5
