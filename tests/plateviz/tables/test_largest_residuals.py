"""Largest residuals, against brute force, known distributions and injected faults."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from scipy import stats

from plateviz import tables
from plateviz.tables.chance import RARE, largest_chi2
from plateviz.tables.largest_residuals import MEASUREMENT, SOURCE
from solver.fit import fit_orbit
from tests.solver.small_orbit import make_orbit


def kind_of(table, kind):
    return table[table["kind"] == kind]


def with_noise(result, count, seed=0):
    """Return the result with `count` measurements of unit normal residuals."""
    random = np.random.default_rng(seed)
    rows = pd.concat([result.residuals] * (count // len(result.residuals) + 1)).head(count)
    noise = random.normal(size=(count, 2))
    return replace(
        result, residuals=rows.assign(standardised_x=noise[:, 0], standardised_y=noise[:, 1])
    )


@pytest.mark.parametrize("count", [1, 200, 260_000])
def test_largest_of_many_exceeds_the_level_in_one_percent(count):
    random = np.random.default_rng(count)
    # The largest of n values has the n-th root of a uniform number as its probability.
    largest = random.uniform(size=200_000) ** (1.0 / count)
    chi2 = stats.chi2.isf(-np.expm1(np.log(largest)), 2)
    share = (chi2 > largest_chi2(count)).mean()
    assert share == pytest.approx(RARE, abs=4.0 * np.sqrt(RARE / 200_000))


def test_level_of_no_value_is_refused():
    with pytest.raises(ValueError, match="expected at least 1, found 0"):
        largest_chi2(0)


def test_upper_tail_is_complete(fit_result):
    result = with_noise(fit_result, 30_000)
    table = kind_of(tables.largest_residuals(result), MEASUREMENT)
    chi = np.hypot(result.residuals["standardised_x"], result.residuals["standardised_y"])
    descending = np.sort(chi.to_numpy())[::-1]
    assert table["rank"].head(1000).tolist() == list(range(1, 1001))
    assert table["rank"].iloc[-1] == table["count"].iloc[0] == 30_000
    assert len(table) < 1500
    assert np.allclose(table["chi"], descending[table["rank"] - 1])


def test_rows_say_which_measurement_it_is(fit_result):
    table = kind_of(tables.largest_residuals(fit_result), MEASUREMENT)
    rows = fit_result.residuals
    chi = np.hypot(rows["standardised_x"], rows["standardised_y"])
    largest = rows.loc[[chi.idxmax()]]
    source, field, plate, detector = (
        largest[name].item() for name in ("source_id", "field_id", "plate_id", "detector_id")
    )
    first = table.iloc[0]
    assert first["id"] == str(source)
    assert first["exposure"] == f"field {field}, exposure {plate}"
    assert first["detector"] == str(detector)


def test_expected_sizes_are_those_of_drawn_values(fit_result):
    result = with_noise(fit_result, 60)
    table = kind_of(tables.largest_residuals(result), MEASUREMENT)
    drawn = np.random.default_rng(5).chisquare(2, (20_000, 60))
    chi = np.sqrt(np.sort(drawn, axis=1)[:, ::-1])
    low, middle, high = np.quantile(chi, [0.025, 0.5, 0.975], axis=0)
    assert np.allclose(table["expected"], middle, atol=0.02)
    assert np.allclose(table["low"], low, atol=0.04)
    assert np.allclose(table["high"], high, atol=0.06)


def test_noise_is_beyond_the_level_as_rarely_as_stated(fit_result):
    levels = [
        kind_of(tables.largest_residuals(with_noise(fit_result, 500, seed)), MEASUREMENT)
        for seed in range(300)
    ]
    found = sum(table["is_beyond"].any() for table in levels)
    # Three are expected; more than nine have a probability of 0.1 %, and none one of 5 %.
    assert 1 <= found <= 9


def test_injected_outlier_is_found_at_its_size():
    orbit = make_orbit()
    rows = orbit.data.measurements.copy()
    rows.loc[123, "nx"] += 10.0 * rows.loc[123, "sx"]
    result = fit_orbit(replace(orbit.data, measurements=rows), orbit.instrument)
    table = tables.largest_residuals(result)
    measurements = kind_of(table, MEASUREMENT)
    assert measurements["is_beyond"].tolist()[:2] == [True, False]
    first = measurements.iloc[0]
    assert first["id"] == str(rows.loc[123, "source_id"])
    left = np.sqrt(1.0 - 0.5 * result.residuals.loc[123, "leverage"])
    assert first["chi"] == pytest.approx(10.0 * left, abs=3.5)


def test_chi_of_a_source_is_as_unlikely_as_its_chi2(fit_result):
    sources = fit_result.sources.copy()
    # The last is too unlikely for its probability to be a number.
    sources.loc[sources.index[:4], "chi2"] = [1e-3, 60.0, 400.0, 9000.0]
    table = kind_of(tables.largest_residuals(replace(fit_result, sources=sources)), SOURCE)
    found = table.set_index("id").loc[[str(i) for i in sources["source_id"][:4]], "chi"]
    logarithms = stats.chi2.logsf(sources["chi2"][:4], sources["dof"][:4])
    assert np.allclose(found[:3], np.sqrt(-2.0 * logarithms[:3]), rtol=1e-9)
    # SciPy's logarithm is minus infinity, too: here by Chernoff's bound, from above.
    x, dof = 9000.0, float(sources["dof"].iloc[3])
    bound = 0.5 * (x - dof - dof * np.log(x / dof))
    assert bound < 0.5 * found.iloc[3] ** 2 < bound + np.log(x)
    assert table.iloc[0]["is_beyond"]
    assert table.iloc[0]["chi2_per_dof"] == pytest.approx(9000.0 / dof)


def test_far_tail_joins_the_exact_one(fit_result):
    """The approximation takes over where the probability is no number any more."""
    sources = fit_result.sources.copy()
    chi2 = np.linspace(700.0, 2500.0, 181)
    sources = sources.head(181).assign(chi2=chi2, dof=95.0)
    table = kind_of(tables.largest_residuals(replace(fit_result, sources=sources)), SOURCE)
    steps = np.diff(table["chi"].to_numpy()[::-1] ** 2)
    # Far from its mean the logarithm falls by nearly as much as chi2 grows, and ever faster.
    assert (np.diff(steps) > -1e-3).all()
    assert (steps > 8.0).all()
    assert (steps < 10.0).all()


def test_sources_of_one_measurement_are_left_out(fit_result):
    sources = fit_result.sources.copy()
    sources.loc[sources.index[0], ["n_obs", "chi2", "dof"]] = [1, 1e-9, 1e-6]
    table = kind_of(tables.largest_residuals(replace(fit_result, sources=sources)), SOURCE)
    assert str(sources["source_id"].iloc[0]) not in set(table["id"])
    assert table["count"].iloc[0] == len(sources) - 1


def test_measurement_that_determines_its_own_prediction_is_left_out(fit_result):
    residuals = fit_result.residuals.copy()
    residuals.loc[residuals.index[:5], ["standardised_x", "standardised_y"]] = np.nan
    table = kind_of(tables.largest_residuals(replace(fit_result, residuals=residuals)), MEASUREMENT)
    assert table["count"].iloc[0] == len(residuals) - 5
    assert np.isfinite(table["chi"]).all()


def test_fit_without_residuals_has_no_rows(fit_result):
    empty = replace(fit_result, residuals=fit_result.residuals.head(0))
    assert kind_of(tables.largest_residuals(empty), MEASUREMENT).empty
