"""Defects of the noise: actual errors over those of the same orbit as stated."""

import numpy as np
import pytest

from tests.solver.simulate.defects.conftest import KEY, QUIET


@pytest.fixture
def ratio(measure):
    """Return the function that gives the rows, and the noise over that without the defect."""

    def of(text):
        quiet, without, with_defect = (
            orbit.measurements.set_index(KEY).sort_index()
            for orbit in (measure(settings=QUIET), measure(), measure(text))
        )
        assert without[["sx", "sy"]].equals(with_defect[["sx", "sy"]])
        axes = ["nx", "ny"]
        before, after = (table[axes] - quiet[axes] for table in (without, with_defect))
        # Differences of near numbers: the smallest errors are inexact.
        found = (after / before).where(before.abs() > 1e-4)
        np.testing.assert_allclose(found.std(axis=1, ddof=0).dropna(), 0.0, atol=1e-5)
        rows = quiet.reset_index()
        factor = found.mean(axis=1).to_numpy()
        known = np.isfinite(factor)
        return rows[known].reset_index(drop=True), factor[known]

    return of


@pytest.mark.parametrize(("text", "expected"), [("noise=10%", 1.1), ("noise=-20%", 0.8)])
def test_noise_is_larger_or_smaller_than_stated(text, expected, ratio):
    _, factor = ratio(text)
    np.testing.assert_allclose(factor, expected, rtol=1e-6)


def test_noise_by_exposure_has_a_lognormal_factor_for_each(ratio):
    rows, factor = ratio("noise-exposure=20%")
    per_exposure = rows.assign(log=np.log(factor)).groupby(["field_id", "plate_id"])["log"]
    assert per_exposure.std().max() < 1e-5
    log = per_exposure.mean()
    assert len(log) == 96
    assert log.std() == pytest.approx(0.2, rel=4.0 / np.sqrt(2 * 96))
    assert abs(log.mean()) < 4.0 * 0.2 / np.sqrt(96)


def test_noise_by_magnitude_grows_from_the_bright_to_the_faint_end(ratio):
    rows, factor = ratio("noise-magnitude=30%")
    expected = np.interp(rows["magnitude"], [8.0, 19.5], [0.7, 1.3])
    np.testing.assert_allclose(factor, expected, rtol=1e-5)
    assert np.ptp(expected) > 0.4
