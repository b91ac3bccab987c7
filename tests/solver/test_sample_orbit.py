"""The sample orbit, simulated by a program that shares no code with the project."""

import numpy as np
import pandas as pd
import pytest
from astropy.table import Table

from solver.data.settings import FitSettings

MIN_OBS = 10
CLASSES = ["non-reference", "artificial"]
AXES = ["ra", "dec"]

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def sample_result(sample_orbit, fit_whole):
    return fit_whole(sample_orbit)


@pytest.fixture(scope="module")
def deviations(sample_result):
    """Estimate minus truth, mas, of sources with at least ten measurements."""
    joined = sample_result.sources.merge(
        sample_result.true_places, on="source_id", suffixes=("", "_true")
    )
    joined = joined[joined["n_obs"] >= MIN_OBS]
    cos_dec = np.cos(np.radians(joined["dec"]))
    joined["deviation_ra"] = 3.6e6 * cos_dec * (joined["ra"] - joined["ra_true"])
    joined["deviation_dec"] = 3.6e6 * (joined["dec"] - joined["dec_true"])
    joined["class"] = np.select(
        [joined["is_reference"], joined["is_artificial"]], ["reference", "artificial"], CLASSES[0]
    )
    return joined


def test_fit_converges_within_six_iterations(sample_result):
    assert sample_result.summary["converged"]
    assert sample_result.summary["iterations"] <= 6


def test_chi2_agrees_with_the_degrees_of_freedom(sample_result):
    dof = sample_result.summary["dof"]
    error = np.sqrt(2.0 / dof)
    assert sample_result.summary["chi2_per_dof"] == pytest.approx(1.0, abs=4.0 * error)


@pytest.mark.parametrize("axis", ["x", "y"])
def test_standardised_residuals_have_unit_scatter(sample_result, axis):
    values = sample_result.residuals[f"standardised_{axis}"]
    assert values.std() == pytest.approx(1.0, abs=4.0 / np.sqrt(2.0 * len(values)))


@pytest.mark.parametrize("axis", AXES)
@pytest.mark.parametrize("kind", CLASSES)
def test_pulls_have_unit_scatter(deviations, kind, axis):
    rows = deviations[deviations["class"] == kind]
    pulls = rows[f"deviation_{axis}"] / rows[f"sigma_{axis}_marginal"]
    assert 0.92 < pulls.std(ddof=0) < 1.10


@pytest.mark.parametrize("axis", AXES)
@pytest.mark.parametrize("kind", CLASSES)
def test_mean_deviation_is_induced_by_reference_errors(deviations, kind, axis):
    """Up to noise: that of each source, and that of the calibration common to all."""
    rows = deviations[deviations["class"] == kind]
    remainder = rows[f"deviation_{axis}"].mean() - rows[f"induced_{axis}"].mean()
    own = np.sqrt((rows[f"sigma_{axis}_conditional"] ** 2).sum()) / len(rows)
    assert abs(remainder) < 4.0 * own * calibration_share(deviations, axis)


def calibration_share(deviations, axis):
    """Return the mean ratio of marginal to conditional sigma."""
    free = deviations[deviations["class"] != "reference"]
    return float((free[f"sigma_{axis}_marginal"] / free[f"sigma_{axis}_conditional"]).mean())


@pytest.mark.parametrize("axis", AXES)
def test_summary_agrees_with_the_deviations(sample_result, deviations, axis):
    for kind in CLASSES:
        rows, figures = (
            deviations[deviations["class"] == kind],
            sample_result.summary["truth"][kind],
        )
        assert figures["n"] == len(rows)
        assert figures[f"mean_{axis}"] == pytest.approx(rows[f"deviation_{axis}"].mean(), abs=1e-6)
        assert figures[f"induced_{axis}"] == pytest.approx(rows[f"induced_{axis}"].mean())


@pytest.mark.parametrize("axis", AXES)
def test_true_positions_agree_with_the_truth_file(sample_orbit_dir, sample_result, axis):
    table = Table.read(sample_orbit_dir / "sample_truth.fits").to_pandas()
    expected = table.set_index("source_id").loc[sample_result.true_places["source_id"]]
    difference = sample_result.true_places[axis].to_numpy() - expected[f"{axis}_epoch"].to_numpy()
    assert np.abs(difference).max() * 3.6e9 < 0.1


def test_true_distortion_is_within_its_uncertainty(sample_result):
    """Eq. (exp:distortion)."""
    rows = sample_result.calibration
    rows = rows[rows["group"].str.startswith("distortion")].set_index("label")
    truth = pd.Series(0.0, index=rows.index)
    named = {"A(1,1)": 0.2, "A(3,0)": 3.0, "A(5,0)": 0.3}
    named |= {"B(1,1)": 0.3, "B(0,3)": -3.0, "B(0,5)": 0.5}
    truth.update(pd.Series(named))
    pulls = (rows["value"] - truth) / rows["sigma_marginal"]
    assert pulls.abs().max() < 4.0
    assert (rows["sigma_marginal"] < 0.1).all()


def test_quadratic_distortion_absorbs_omitted_aberration(sample_orbit, sample_result, fit_whole):
    without = fit_whole(sample_orbit, FitSettings(aberration=False))
    moved = without.values_on("coef").to_numpy() - sample_result.values_on("coef").to_numpy()
    quadratic, others = np.abs(moved[:3]), np.abs(moved[3:])
    # The scale changes by 1e-4, which changes a true cubic term of 3 um by less than 1 nm.
    assert 3e-3 < quadratic.max() < 1e-2
    assert others.max() < 1e-3
    assert without.summary["chi2"] == pytest.approx(sample_result.summary["chi2"], rel=1e-5)


def test_flags_are_read(sample_result):
    assert sample_result.summary["n_reference"] == 58
    assert sample_result.sources["is_artificial"].any()


def test_weak_directions_are_those_of_the_geometry(sample_result):
    modes = sample_result.eigenmodes
    is_weak = modes["data_share"] < 1e-3
    # Shift, roll and scale of the detectors against the pointings; shift, roll, scale and
    # stretch of the sky; and the two quadratic maps that pointings, focal lengths, position
    # angles and the distortion can compensate.
    assert is_weak.sum() == 11
    weakest = modes[is_weak].head(4)
    assert (weakest["relative_information"] < 1e-6).all()
    assert (modes[is_weak]["relative_information"].iloc[4:] > 1e-3).all()
    assert (modes[is_weak]["reference_share"].iloc[4:] > 0.999).all()
    assert weakest["name"].str.contains("detector").all()
