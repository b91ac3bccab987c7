"""Outliers are found, listed and left out, and do not bias the other sources."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from solver.data import schema
from solver.data.settings import FitSettings
from solver.data.subset import Subset
from solver.errors import CancelledError
from solver.fit import OrbitFitter, fit_orbit

ROBUST = FitSettings(robust=True)
SHARE, SIGMAS = 0.01, 50.0


def disturbed(data, share, sigmas, seed=1):
    """Return the orbit with a fraction of its measurements displaced, and their rows."""
    rng = np.random.default_rng(seed)
    rows = data.measurements.copy()
    bad = rng.choice(len(rows), round(share * len(rows)), replace=False)
    angle = rng.uniform(0.0, 2.0 * np.pi, len(bad))
    for column, direction in (("nx", np.cos(angle)), ("ny", np.sin(angle))):
        position = rows.columns.get_loc(column)
        rows.iloc[bad, position] += sigmas * rows[f"s{column[1]}"].to_numpy()[bad] * direction
    return replace(data, measurements=rows), bad


@pytest.fixture(scope="module")
def clean(sample_orbit, fit_whole):
    return fit_whole(sample_orbit)


@pytest.fixture(scope="module")
def found(sample_orbit, fit_whole):
    data, bad = disturbed(sample_orbit, SHARE, SIGMAS)
    return fit_whole(data, ROBUST), data, bad


@pytest.fixture(scope="module")
def plain(found, fit_whole):
    """The disturbed orbit fitted without a search for outliers."""
    return fit_whole(found[1])


def shifts(found, clean, axis):
    """Return the shifts of the sources without a disturbed measurement, in sigmas."""
    result, data, bad = found
    both = result.sources.merge(clean.sources, on="source_id", suffixes=("", "_clean"))
    disturbed_ids = data.measurements["source_id"].iloc[bad]
    both = both[~both["source_id"].isin(disturbed_ids)]
    assert len(both) > 400
    moved = both[f"offset_{axis}"] - both[f"offset_{axis}_clean"]
    return moved / both[f"sigma_{axis}_marginal_clean"]


@pytest.mark.slow
@pytest.mark.parametrize("axis", ["ra", "dec"])
def test_undisturbed_sources_are_not_biased(found, clean, axis):
    moved = shifts(found, clean, axis)
    assert abs(moved.mean()) < 0.1
    assert np.sqrt((moved**2).mean()) < 0.1


@pytest.fixture(scope="module", params=[pytest.param("all", marks=pytest.mark.full), "exposure"])
def understated(request, found):
    """The disturbed orbit with half the uncertainties, of all exposures or of every third one."""
    rows = found[1].measurements
    is_half = (rows["plate_id"] % 3 == 0) | (request.param == "all")
    factor = np.where(is_half, 0.5, 1.0)
    data = replace(
        found[1], measurements=rows.assign(sx=rows["sx"] * factor, sy=rows["sy"] * factor)
    )
    name = "noise_scale" if request.param == "all" else "noise_by_exposure"
    return data, ROBUST.with_(**{name: True})


@pytest.mark.slow
def test_outliers_and_a_noise_model_are_found_together(understated, found, fit_whole):
    data, settings = understated
    result = fit_whole(data, settings)
    # As with the right uncertainties.
    right = set(found[0].outliers.index)
    assert len(right ^ set(result.outliers.index)) <= 2
    assert result.summary["chi2_per_dof"] == pytest.approx(1.0, abs=0.01)
    found_factor = np.exp(list(result.summary["noise"]["log_factor"].values()))
    is_understated = found_factor > 1.5
    expected = 1.0 if settings.noise_scale else 1.0 / 3.0
    assert is_understated.mean() == pytest.approx(expected, abs=0.05)
    assert found_factor[is_understated].mean() == pytest.approx(2.0, abs=0.03)


@pytest.mark.slow
def test_good_measurements_with_understated_errors_are_no_outliers(found, fit_whole):
    rows = found[1].measurements
    data = replace(found[1], measurements=rows.assign(sx=rows["sx"] / 3, sy=rows["sy"] / 3))
    result = fit_whole(data, ROBUST)
    assert len(set(found[0].outliers.index) ^ set(result.outliers.index)) <= 2
    assert result.summary["chi2_per_dof"] == pytest.approx(9.0, rel=0.1)


@pytest.mark.slow
@pytest.mark.parametrize("axis", ["ra", "dec"])
def test_undisturbed_sources_are_biased_without_the_robust_fit(plain, found, clean, axis):
    moved = shifts((plain, *found[1:]), clean, axis)
    assert np.sqrt((moved**2).mean()) > 0.5


@pytest.mark.slow
def test_exactly_the_outliers_are_listed(found):
    result, data, bad = found
    expected = data.measurements.iloc[bad]
    listed = result.outliers
    key = ["field_id", "plate_id", "detector_id", "source_id"]
    assert set(listed[key].itertuples(index=False)) == set(expected[key].itertuples(index=False))
    assert list(listed.columns) == schema.OUTLIERS.names
    assert listed["distance"].is_monotonic_decreasing
    assert listed["distance"].between(SIGMAS - 6.0, SIGMAS + 6.0).all()


@pytest.mark.slow
def test_remaining_measurements_fit_well(found):
    result, data, bad = found
    assert result.summary["n_outliers"] == len(bad)
    assert result.summary["n_measurements"] == len(data.measurements) - len(bad)
    assert result.summary["chi2_per_dof"] == pytest.approx(1.0, abs=0.02)


@pytest.mark.slow
def test_shift_is_how_far_an_outlier_would_move_its_source(found, fit_whole):
    """The reference is a fit that includes this one outlier."""
    result, data, _ = found
    worst = next(result.outliers.itertuples())
    key = ["field_id", "plate_id", "detector_id", "source_id"]
    rows = data.measurements
    is_outlier = pd.MultiIndex.from_frame(rows[key]).isin(
        pd.MultiIndex.from_frame(result.outliers[key].iloc[1:])
    )
    used = fit_whole(replace(data, measurements=rows[~is_outlier]))
    before, after = (r.sources.set_index("source_id").loc[worst.source_id] for r in (result, used))
    for axis in ("ra", "dec"):
        moved = (after[f"offset_{axis}"] - before[f"offset_{axis}"]) / before[
            f"sigma_{axis}_marginal"
        ]
        assert getattr(worst, f"shift_{axis}") == pytest.approx(moved, abs=0.3)


@pytest.mark.slow
def test_orbit_without_outliers_is_unchanged(sample_orbit, clean, fit_whole):
    result = fit_whole(sample_orbit, ROBUST)
    assert result.summary["n_outliers"] == 0
    pd.testing.assert_frame_equal(result.sources, clean.sources)


@pytest.mark.slow
def test_outliers_are_not_searched_for_by_default(clean):
    assert clean.outliers is None
    assert "n_outliers" not in clean.summary


def test_what_if_leaves_out_the_same_outliers(small_orbit):
    data, bad = disturbed(small_orbit.data, 0.01, 200.0)
    fitter = OrbitFitter(data, small_orbit.instrument)
    fitted = fitter.fit(ROBUST)
    assert len(fitted.outliers) >= len(bad)
    source = int(fitted.sources["source_id"].iloc[0])
    changed = fitter.what_if(ROBUST.with_(exclusions=Subset(sources=frozenset([source]))))
    pd.testing.assert_frame_equal(changed.outliers, fitted.outliers)
    assert changed.summary["n_measurements"] < fitted.summary["n_measurements"]
    detector = int(fitted.outliers["detector_id"].iloc[0])
    others = fitted.outliers[fitted.outliers["detector_id"] != detector]
    fewer = fitter.what_if(ROBUST.with_(exclusions=Subset(detectors=frozenset([detector]))))
    assert fewer.summary["n_outliers"] == len(others) < len(fitted.outliers)
    pd.testing.assert_frame_equal(fewer.outliers, others.reset_index(drop=True))
    assert fitter.what_if(FitSettings()) is None


def test_search_can_be_cancelled(small_orbit):
    def cancel(row):
        raise CancelledError("now")

    with pytest.raises(CancelledError):
        fit_orbit(small_orbit.data, small_orbit.instrument, ROBUST, cancel)
