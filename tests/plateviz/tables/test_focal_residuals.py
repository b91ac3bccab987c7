"""Residuals on the focal plane, against the detectors' rotation written out."""

from dataclasses import replace

import numpy as np
import pytest

from plateviz import tables
from plateviz.tables.focal_residuals import focal_residuals
from plateviz.tables.labels import exposure_labels
from tests.plateviz.tables.fields import MAS_PER_MPIX, left_by_sources, with_fitted_sources


def test_vectors_are_those_of_the_residual_map(fit_result, instrument):
    found, mapped = (
        focal_residuals(fit_result, instrument),
        tables.residual_map(fit_result, instrument),
    )
    # 10 um per pixel, and the map is in mm.
    assert np.allclose(found.vector, 1e5 * mapped[["u", "v"]], rtol=1e-9, atol=1e-9)
    assert np.array_equal(found.at, mapped[["x", "y"]])
    assert found.mas_per_mpix == pytest.approx(mapped["mas_per_unit"].mean() * 1e-5, rel=1e-4)
    assert found.mas_per_mpix == pytest.approx(MAS_PER_MPIX, rel=1e-4)
    assert found.arcmin_per_mm == pytest.approx(mapped["mas_per_unit"].mean() / 6e4, rel=1e-4)


def test_exposures_and_sources_are_those_of_the_rows(fit_result, instrument):
    shuffled = replace(fit_result, residuals=fit_result.residuals.sample(frac=1.0, random_state=1))
    found = focal_residuals(shuffled, instrument)
    names = exposure_labels(fit_result.exposures).to_numpy()[found.exposure]
    assert names.tolist() == exposure_labels(shuffled.residuals).tolist()
    ids = fit_result.sources["source_id"].to_numpy()[found.source]
    assert ids.tolist() == shuffled.residuals["source_id"].tolist()


def test_weights_turn_with_the_detectors(fit_result, instrument):
    rows = fit_result.residuals.assign(sx=0.02, sy=0.005)
    found = focal_residuals(replace(fit_result, residuals=rows), instrument)
    for number, detector in enumerate(instrument.detectors):
        c, s = (f(np.radians(detector.rotation_deg)) for f in (np.cos, np.sin))
        turn = np.array([(c, s), (-s, c)])
        covariance = turn @ np.diag([20.0**2, 5.0**2]) @ turn.T
        weight = found.weight[found.detector == number]
        assert np.allclose(1.0 / weight, np.diag(covariance), rtol=1e-6)


def test_sources_keep_the_variance_of_the_sum_that_they_leave(fit_result, instrument):
    result = with_fitted_sources(fit_result)
    found = focal_residuals(result, instrument)
    cells = np.arange(len(found)) // 7 % 31
    kept = found.kept_by_sources(cells, 31)
    for cell in range(31):
        # The projection is symmetric, so that the variance is its value on the cell itself.
        inside = np.stack([(cells == cell).astype(float)] * 2, axis=-1)
        left = left_by_sources(result, inside)[cells == cell].sum(axis=0)
        assert np.allclose(kept[cell], left / 10.0**2, rtol=1e-3)
