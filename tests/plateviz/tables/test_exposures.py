"""Which exposure a measurement is of, which measurements are selected, and when exposures were."""

from dataclasses import replace

import numpy as np
import pytest

from plateviz.tables.exposures import is_shown, minutes_since_first

KEYS = ["field_id", "plate_id"]


def test_each_measurement_has_its_exposure(fit_result):
    """In any order of measurements and of exposures."""
    shuffled = replace(
        fit_result,
        residuals=fit_result.residuals.sample(frac=1.0, random_state=1),
        exposures=fit_result.exposures.sample(frac=1.0, random_state=2),
    )
    found = shuffled.exposures[KEYS].to_numpy()[shuffled.exposure_index]
    np.testing.assert_array_equal(found, shuffled.residuals[KEYS])


def test_selection_keeps_these_exposures_and_this_detector(fit_result):
    rows = fit_result.residuals
    found = rows[is_shown(fit_result, [(1, 2), (3, 0), (9, 9)], 2)]
    expected = rows.query(
        "detector_id == 2 and (field_id == 1 and plate_id == 2 or field_id == 3 and plate_id == 0)"
    )
    assert len(found) > 0
    assert found.equals(expected)


@pytest.mark.parametrize(("exposures", "share"), [(None, 1.0), ([], 0.0)])
def test_nothing_said_is_all_and_an_empty_selection_is_nothing(fit_result, exposures, share):
    assert is_shown(fit_result, exposures, None).mean() == share


def test_times_begin_with_the_first_exposure(fit_result):
    minutes = minutes_since_first(fit_result.exposures)
    assert minutes.min() == 0.0
    days = np.diff(fit_result.exposures["obstime"])
    np.testing.assert_allclose(np.diff(minutes), 1440.0 * days, atol=1e-6)
    assert len(minutes_since_first(fit_result.exposures.head(0))) == 0
