import numpy as np
import pytest

from solver.data.survey_schema import ERRORS_BY_COUNT, MOTIONS, N_DRAWS
from solver.results.time_series import errors_by_count, motion_table
from tests.solver.survey_history import EPOCH, PIXELS_MAS, make_history

N_SOURCES, N_ORBITS = 200, 30
NO_MOTION = np.zeros((N_SOURCES, 5))
FLOOR_MAS = 0.2


def shifted(history, shift):
    """Return the history with every estimate shifted."""
    return history.assign(offset_ra=history["offset_ra"] + shift)


@pytest.fixture(scope="module")
def history():
    return make_history(NO_MOTION, N_ORBITS, artificial=True)


@pytest.fixture(scope="module")
def table(history):
    return motion_table(history, EPOCH)


def test_motion_table_matches_the_schema(table):
    assert list(table.columns) == MOTIONS.names
    for column in MOTIONS:
        assert table[column.name].dtype == column.dtype
    assert (table["n_orbits"] == N_ORBITS).all()
    assert (table["n_obs"] == 36 * N_ORBITS).all()


def test_scatter_matches_its_expectation(table):
    for axis in ("ra", "dec"):
        ratio = table[f"scatter_{axis}"] / table[f"expected_scatter_{axis}"]
        assert (ratio**2).mean() == pytest.approx(1.0, abs=0.1)


def test_separations_have_separate_columns(table):
    both = table["rms_truth_ra"] ** 2 + table["rms_truth_dec"] ** 2
    np.testing.assert_allclose(table["rms_truth_2d"] ** 2, both)
    assert table["rms_truth_2d"].mean() == pytest.approx(PIXELS_MAS * np.sqrt(2.0), rel=0.03)


def test_offset_changes_the_mean_but_not_the_scatter(history, table):
    moved = motion_table(shifted(history, 1.0), EPOCH)
    np.testing.assert_allclose(moved["mean_deviation_ra"] - table["mean_deviation_ra"], 1.0)
    np.testing.assert_allclose(moved["scatter_ra"], table["scatter_ra"])


def test_catalogue_errors_raise_the_expected_mean_deviation():
    draws = np.zeros((N_SOURCES, N_DRAWS, 5))
    draws[:, :, 0] = FLOOR_MAS * np.where(np.arange(N_DRAWS) % 2, 1.0, -1.0)
    found = motion_table(make_history(NO_MOTION, N_ORBITS, draws=draws), EPOCH)
    expected = np.hypot(PIXELS_MAS / np.sqrt(N_ORBITS), FLOOR_MAS)
    np.testing.assert_allclose(found["expected_deviation_ra"], expected, rtol=1e-6)
    np.testing.assert_allclose(found["sigma_catalogue_ra"], FLOOR_MAS, rtol=1e-5)
    np.testing.assert_allclose(found["sigma_catalogue_dec"], 0.0, atol=1e-5)


def test_without_truth_there_is_no_deviation(history):
    without_truth = history.assign(true_offset_ra=np.nan, true_offset_dec=np.nan)
    found = motion_table(without_truth, EPOCH)
    assert found["pull_ra"].isna().all()
    assert found["mean_deviation_ra"].isna().all()
    assert found["fit_pmra"].notna().all()


def test_errors_fall_with_the_square_root_of_the_orbits(history):
    errors = errors_by_count(history, [1, 4, 9, 30])
    assert list(errors.columns) == ERRORS_BY_COUNT.names
    expected = PIXELS_MAS / np.sqrt(errors["n_orbits"])
    np.testing.assert_allclose(errors["expected_mas"], expected, rtol=1e-6)
    np.testing.assert_allclose(errors["error_mas"], expected, rtol=0.15)
    inside = (errors["error_low_mas"] < expected) & (expected < errors["error_high_mas"])
    assert inside.sum() >= 2


def test_errors_reach_the_floor_of_the_catalogue():
    draws = np.zeros((N_SOURCES, N_DRAWS, 5))
    draws[:, :, :2] = FLOOR_MAS
    unshifted = make_history(NO_MOTION, N_ORBITS, noise=1e-3, draws=draws)
    moved = unshifted.assign(offset_ra=unshifted["offset_ra"] + FLOOR_MAS)
    moved["offset_dec"] -= FLOOR_MAS
    errors = errors_by_count(moved, [1, 30])
    np.testing.assert_allclose(errors["floor_mas"], FLOOR_MAS, rtol=1e-6)
    np.testing.assert_allclose(errors["error_mas"], errors["expected_mas"], rtol=1e-3)


def test_counts_with_too_few_samples_are_omitted(history):
    three_sources = history[history["source_id"] < history["source_id"].min() + 3].reset_index(
        drop=True
    )
    assert errors_by_count(three_sources, [2, 20])["n_orbits"].tolist() == [2]
