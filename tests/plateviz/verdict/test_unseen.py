"""What no test of one orbit can see: how large it could be."""

from dataclasses import replace

import numpy as np
import pytest

from plateviz.verdict.unseen import quadratic_mas, unnoticed_factor, unseen_sentences
from plateviz.verdict.verdict import orbit_verdict
from solver.results.diagnosis.epoch import EpochOffset


def with_summary(result, **values):
    return replace(result, summary={**result.summary, **values})


def test_quadratic_terms_are_the_limit_of_quadratic_errors(fit_result):
    result = with_summary(fit_result, distortion_scale_um=21_000.0)
    calibration = result.calibration.copy()
    is_term = calibration["group"].isin(["distortion_x", "distortion_y"])
    calibration.loc[is_term, "offset"] = 0.0
    none = replace(result, calibration=calibration)
    assert quadratic_mas(none) == 0.0
    # A term that is the product of both coordinates, along x alone.
    calibration = calibration.copy()
    chosen = (calibration["group"] == "distortion_x") & (calibration["element"] == 1)
    calibration.loc[chosen, "offset"] = 2.0
    found = quadratic_mas(replace(result, calibration=calibration))
    x, y = result.residuals[["focal_x", "focal_y"]].to_numpy().T / 21_000.0
    focal_length = result.values_on("exp")["focal_length"].mean()
    expected = 2.0 * np.std(x * y) / focal_length * np.degrees(1.0) * 3.6e6
    assert found == pytest.approx(expected)
    assert f"{found:.2g} mas rms" in " ".join(
        unseen_sentences(replace(result, calibration=calibration), EpochOffset(0.0, 5.0))
    )


def test_sentences_on_smooth_errors_stand_together(fit_result):
    result = with_summary(fit_result, distortion_scale_um=21_000.0)
    smooth, quadratic, time, *_ = unseen_sentences(result, EpochOffset(0.0, 5.0))
    assert "smooth errors" in smooth
    assert quadratic.startswith("Those that are quadratic")
    assert time.startswith("A time that is wrong")


def test_time_that_is_not_tested_is_not_put_down_to_the_catalogue(fit_result):
    unknown = EpochOffset(float("nan"), float("nan"))
    (time,) = (one for one in unseen_sentences(fit_result, unknown) if "A time" in one)
    assert "is not tested" in time
    assert "ten reference stars" in time


def test_result_of_an_older_version_has_no_limit(fit_result):
    summary = {k: v for k, v in fit_result.summary.items() if k != "distortion_scale_um"}
    assert np.isnan(quadratic_mas(replace(fit_result, summary=summary)))


def test_references_that_the_data_do_not_determine_may_be_far_off(fit_result):
    def factor(expected, freedom):
        values = {f"expected_normalised_deviation_{one}": expected for one in ("ra", "dec")}
        values |= {f"normalised_deviation_dof_{one}": freedom for one in ("ra", "dec")}
        return unnoticed_factor(with_summary(fit_result, **values))

    # Three sigma of the scatter are 30 %.
    assert factor(1.0, 50.0) == pytest.approx(1.3)
    assert factor(0.3, 50.0) == pytest.approx(np.sqrt(1.0 + 0.69 / 0.09))
    assert factor(1.0, 5000.0) < factor(1.0, 50.0)
    assert np.isnan(factor(0.0, 50.0))


def test_verdict_says_what_it_cannot_see(fit_result):
    reasons = orbit_verdict(fit_result).reasons
    assert any("smooth errors of the reference catalogue" in sentence for sentence in reasons)
    assert any("times as large as stated before they are noticed" in one for one in reasons)


def test_many_reference_stars_that_are_left_out_need_care(fit_result):
    whole, n_left = orbit_verdict(fit_result), int(fit_result.summary["n_reference"])
    few = with_summary(fit_result, n_reference_excluded=n_left // 20)
    many = with_summary(fit_result, n_reference_excluded=n_left // 4)
    of_few, of_many = map(orbit_verdict, (few, many))
    assert (of_few.state, of_few.headline) == (whole.state, whole.headline)
    assert of_many.state != "good"
    total = n_left + n_left // 4
    assert any(f"{n_left // 4} of {total} reference stars are" in one for one in of_many.reasons)
    assert of_many.faults
