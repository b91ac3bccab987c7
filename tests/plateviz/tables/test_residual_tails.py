"""Tails of the residuals, against known distributions, injected faults and the solver's test."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from scipy import stats

from plateviz import tables
from plateviz.tables.residual_tails import AXIS, DETECTOR, EXPOSURE
from solver.results.diagnosis.read_rows import camera_rows
from solver.results.diagnosis.scatter import scatter_tests


@pytest.fixture(scope="module")
def result(make_fit_result):
    return make_fit_result(7, n_sources=1500)[0]


def with_pulls(result, pulls, leverage=0.0):
    """Return the result with given standardised residuals (n, 2); a row per measurement."""
    rows = result.residuals
    rows = rows.iloc[np.arange(len(pulls)) % len(rows)].reset_index(drop=True)
    left = np.sqrt(1.0 - 0.5 * leverage)
    residuals = {
        f"residual_{axis}": pulls[:, k] * rows[f"s{axis}"] * left for k, axis in enumerate("xy")
    }
    standardised = {f"standardised_{axis}": pulls[:, k] for k, axis in enumerate("xy")}
    return replace(result, residuals=rows.assign(leverage=leverage, **residuals, **standardised))


def normal(count, seed):
    return np.random.default_rng(seed).normal(size=(count, 2))


def mixed(count, seed, share=0.01, factor=5.0):
    """Return normal values of which a share is wider."""
    random = np.random.default_rng(seed)
    wide = random.random(count) < share
    return random.normal(size=(count, 2)) * np.where(wide, factor, 1.0)[:, None]


def test_numbers_of_normal_residuals_are_as_expected(result):
    pulls = normal(100_000, 1)
    table = tables.residual_tails(with_pulls(result, pulls))
    assert table["axis"].tolist() == ["x"] * 11 + ["y"] * 11
    for row in table.itertuples():
        assert row.found == (np.abs(pulls[:, "xy".index(row.axis)]) > row.threshold).sum()
        assert abs(row.found - row.expected) < 4.0 * row.scatter + 0.5
    assert table["is_beyond"].sum() < 4
    assert table["width"].iloc[0] == pytest.approx(1.0, abs=0.01)


def test_expected_numbers_and_scatter_are_those_of_a_binomial_distribution(result):
    table = tables.residual_tails(with_pulls(result, normal(20_000, 2)))
    for row in table.itertuples():
        chance = stats.binom(20_000, 2.0 * stats.norm.sf(row.threshold))
        assert row.expected == pytest.approx(chance.mean())
        assert row.scatter == pytest.approx(chance.std())
        below, above = chance.cdf(np.ceil(row.low) - 1.0), chance.sf(np.floor(row.high))
        # Two sigma on each side; rare numbers have steps that pass it.
        assert max(below, above) < 0.0235
        if row.expected > 30.0:
            assert min(below, above) > 0.018


def test_scatter_allows_for_what_the_fit_makes_common(result):
    """Of three measurements of a source, its position takes a third, and correlates the rest."""
    stars = 1000
    found, random = [], np.random.default_rng(3)
    for _ in range(200):
        noise = random.normal(size=(stars, 3, 2))
        left = (noise - noise.mean(axis=1, keepdims=True)) * np.sqrt(1.5)
        fitted = with_pulls(result, left.reshape(-1, 2), leverage=2.0 / 3.0)
        found.append(tables.residual_tails(fitted, (1.0, 2.0, 3.0)))
    every = pd.concat(found)
    z = (every["found"] - every["expected"]) / every["scatter"]
    for at, values in z.groupby(every["threshold"]):
        assert values.mean() == pytest.approx(0.0, abs=0.15), at
        assert values.std() == pytest.approx(1.0, abs=4.0 / np.sqrt(2 * len(values))), at
    # Independent residuals would scatter by a tenth less.
    one = every[every["threshold"] == 1.0].iloc[0]
    assert one["scatter"] > 1.1 * np.sqrt(one["expected"] * (1.0 - one["expected"] / one["n"]))


def test_few_measurements_with_large_errors_show_in_the_tail_alone(result):
    table = tables.residual_tails(with_pulls(result, mixed(100_000, 4)))
    tail = table["threshold"] >= 3.5
    assert table.loc[tail, "is_beyond"].all()
    assert (table.loc[tail, "ratio"] > 3.0).all()
    assert table.loc[table["threshold"] == 1.0, "ratio"].max() < 1.03
    assert table["width"].iloc[0] == pytest.approx(1.01, abs=0.01)


def test_single_outlier_is_beyond_the_range_where_none_is_expected(result):
    pulls = np.clip(normal(20_000, 5), -4.0, 4.0)
    pulls[17, 1] = 7.0
    table = tables.residual_tails(with_pulls(result, pulls))
    found = table[table["is_beyond"]]
    assert set(found["axis"]) == {"y"}
    assert found["threshold"].min() >= 5.0
    assert found["threshold"].max() == 6.0


def test_misstated_errors_are_those_of_the_measured_width(result):
    table = tables.residual_tails(with_pulls(result, 1.5 * normal(100_000, 6)))
    assert table["width"].iloc[0] == pytest.approx(1.5, abs=0.01)
    assert table.loc[table["threshold"] >= 1.5, "is_beyond"].all()
    often = table["of_width"] > 300.0
    found, expected = table.loc[often, "found"], table.loc[often, "of_width"]
    assert np.allclose(found / expected, 1.0, atol=0.2)


def test_no_residuals_have_no_numbers(result):
    empty = replace(result, residuals=result.residuals.head(0))
    assert (tables.residual_tails(empty)["n"] == 0).all()
    groups = tables.kurtosis_by_group(empty)
    assert groups["kind"].tolist() == [AXIS, AXIS]


def of_kind(groups, kind):
    return groups[groups["kind"] == kind].reset_index(drop=True)


def mean_of(groups, kind):
    rows = of_kind(groups, kind)
    return float(np.average(rows["kurtosis"].to_numpy(), weights=rows["n"].to_numpy()))


def test_kurtosis_is_that_of_the_test_of_the_solution(result):
    """Also with outliers, and with an exposure that scatters by more, where fewer are outliers."""
    pulls = mixed(len(result.residuals), 8, 0.03, 4.0)
    pulls[result.exposure_index == 2] *= 2.5
    leverage = np.random.default_rng(8).uniform(0.0, 0.8, len(pulls))
    leverage[:5] = 1.99
    given = with_pulls(result, pulls, leverage)
    rows = camera_rows(given)[1]
    assert rows.is_far.sum() > 5
    tests = scatter_tests(rows, np.full(len(given.sources), np.nan))
    (test,) = (one for one in tests if one.name == "kurtosis")
    groups = tables.kurtosis_by_group(given)
    assert of_kind(groups, EXPOSURE)["n"].sum() == test.freedom
    for kind in (EXPOSURE, DETECTOR):
        assert mean_of(groups, kind) == pytest.approx(test.value, rel=1e-7)
    assert test.value > 10.0 * test.scatter


def test_kurtosis_of_noise_is_within_its_range(result):
    count = len(result.residuals)
    found = [
        tables.kurtosis_by_group(with_pulls(result, normal(count, 100 + seed)))
        for seed in range(60)
    ]
    every = pd.concat(found)
    for kind, rows in every.groupby("kind"):
        n = len(rows)
        values = (rows["kurtosis"] / rows["scatter"]).to_numpy()
        assert values.mean() == pytest.approx(0.0, abs=4.0 / np.sqrt(n)), kind
        assert values.std() == pytest.approx(1.0, abs=6.0 / np.sqrt(n)), kind
        assert rows["sigmas"].std() == pytest.approx(1.0, abs=4.0 / np.sqrt(n)), kind
        for outside in (rows["kurtosis"] < rows["low"], rows["kurtosis"] > rows["high"]):
            assert outside.mean() == pytest.approx(0.0228, abs=4.0 * np.sqrt(0.0228 / n)), kind
        inside = rows["sigmas"].abs() < 2.0
        assert (inside == rows["kurtosis"].between(rows["low"], rows["high"])).all(), kind


def test_kurtosis_of_uniform_residuals_is_negative(result):
    pulls = np.random.default_rng(9).uniform(
        -np.sqrt(3.0), np.sqrt(3.0), (len(result.residuals), 2)
    )
    groups = tables.kurtosis_by_group(with_pulls(result, pulls))
    of_axes = of_kind(groups, AXIS)
    assert of_axes["name"].tolist() == ["x", "y"]
    # That of a uniform distribution is -1.2.
    assert np.allclose(of_axes["kurtosis"], -1.2, atol=0.1)
    assert (of_kind(groups, EXPOSURE)["sigmas"] < 0.0).all()


def test_axis_with_tails_is_named(result):
    pulls = normal(len(result.residuals), 10)
    pulls[:, 1] = mixed(len(pulls), 11, 0.05, 3.0)[:, 1]
    x, y = of_kind(tables.kurtosis_by_group(with_pulls(result, pulls)), AXIS)["sigmas"]
    assert abs(x) < 4.0 < 10.0 < y


def test_disturbed_exposure_and_detector_are_told_apart_from_tails_everywhere(result):
    noise = normal(len(result.residuals), 12)
    wide = np.random.default_rng(12).random(len(noise)) < 0.1
    exposure, detector = result.exposure_index, result.residuals["detector_id"].to_numpy()

    def beyond(is_disturbed, kind):
        pulls = noise * np.where(wide & is_disturbed, 3.0, 1.0)[:, None]
        rows = of_kind(tables.kurtosis_by_group(with_pulls(result, pulls)), kind)
        return rows.loc[rows["sigmas"] > 4.0, "index"].tolist()

    assert beyond(exposure == 5, EXPOSURE) == [5]
    assert beyond(detector == 2, DETECTOR) == [2]
    assert len(beyond(exposure >= 0, EXPOSURE)) == len(result.exposures)


def test_exposures_of_different_noise_have_large_numbers_and_no_kurtosis(result):
    pulls = normal(len(result.residuals), 13)
    pulls[result.exposure_index < 3] *= 2.0
    given = with_pulls(result, pulls)
    tail = tables.residual_tails(given)
    assert tail.loc[tail["threshold"].between(3.0, 4.0), "is_beyond"].all()
    groups = tables.kurtosis_by_group(given)
    assert of_kind(groups, AXIS)["sigmas"].abs().max() < 4.0
    assert of_kind(groups, EXPOSURE)["sigmas"].abs().max() < 4.0


def test_exposures_are_named_and_those_of_few_measurements_have_no_row(result):
    exposure = result.exposure_index
    few = (exposure != 1) | (np.cumsum(exposure == 1) <= 7)
    given = replace(result, residuals=result.residuals[few].reset_index(drop=True))
    rows = of_kind(tables.kurtosis_by_group(given), EXPOSURE)
    assert rows["index"].tolist() == [0, *range(2, len(result.exposures))]
    assert rows["exposure"].iloc[0] == rows["name"].iloc[0] == "field 0, exposure 0"
    others = tables.kurtosis_by_group(given).query("kind != 'exposure'")
    assert (others["exposure"] == "").all()
