"""Mean residuals of each field against the others: chance, displacements, and one field."""

from dataclasses import replace

import numpy as np
import pytest

from plateviz.tables.field_residuals import field_residuals, field_statistics


@pytest.fixture(scope="module")
def fields(fit_result):
    return sorted(fit_result.exposures["field_id"].unique())


def displaced(result, field, detector, pixels):
    """Return a result in which one detector is displaced along its x in one field."""
    residuals = result.residuals.copy()
    rows = (residuals["field_id"] == field) & (residuals["detector_id"] == detector)
    residuals.loc[rows, "residual_x"] += pixels
    return replace(result, residuals=residuals)


def test_fields_of_a_good_solution_differ_by_chance(fit_result, instrument, fields):
    table = field_residuals(fit_result, instrument)
    assert sorted(table["field_id"].unique()) == fields
    for _, rows in table.groupby("field_id"):
        found = field_statistics(rows)
        assert found.dof == 2 * len(rows)
        assert abs(found.chi2 - found.dof) < 4.0 * found.scatter
        assert found.largest < found.limit + 1.0


def test_displacement_in_one_field_is_seen_there_and_opposite_elsewhere(
    fit_result, instrument, fields
):
    detector, last = instrument.detectors[0].detector_id, fields[-1]
    moved = displaced(fit_result, last, detector, 0.05)
    before, after = (field_residuals(one, instrument) for one in (fit_result, moved))
    axes = [f"difference_{axis}_mpix" for axis in "xy"]
    change = np.hypot(*(after[axes] - before[axes]).to_numpy().T)
    is_there = (after["detector_id"] == detector).to_numpy()
    is_last = (after["field_id"] == last).to_numpy()
    assert np.all(change[~is_there] == pytest.approx(0.0, abs=1e-9))
    assert np.median(change[is_there & is_last]) > 40.0
    # The others share it among them.
    assert 0.0 < np.median(change[is_there & ~is_last]) < 40.0


def test_single_field_has_no_others(fit_result, instrument, fields):
    rows = fit_result.residuals["field_id"] == fields[0]
    exposures = fit_result.exposures["field_id"] == fields[0]
    one = replace(
        fit_result,
        residuals=fit_result.residuals[rows].reset_index(drop=True),
        exposures=fit_result.exposures[exposures].reset_index(drop=True),
    )
    assert field_residuals(one, instrument).empty
