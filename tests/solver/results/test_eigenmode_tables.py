"""The eigenmode tables of a fit are complete and consistent with each other."""

import numpy as np
import pandas as pd
import pytest

from solver.data.schema import EIGENMODE_TABLES
from solver.results.eigenmodes import MAX_NAMED, WEAK


@pytest.mark.parametrize("table", EIGENMODE_TABLES, ids=lambda table: table.name)
def test_columns_are_those_of_the_schema(result, table):
    frame = getattr(result, table.name)
    assert list(frame.columns) == table.names
    assert not frame.isna().any(axis=None)
    assert not frame.duplicated(list(table.key)).any()


def test_there_is_one_eigenmode_per_calibration_parameter(result):
    assert len(result.eigenmodes) == len(result.calibration)
    assert result.eigenmodes["mode"].tolist() == list(range(1, len(result.calibration) + 1))


def test_weak_eigenmodes_are_named(result):
    weak = result.eigenmodes["data_share"] < WEAK
    named = result.eigenmodes["name"] != ""
    assert named.sum() == min(weak.sum(), MAX_NAMED) > 3
    assert weak[named].all()


def test_shares_of_an_eigenmode_sum_to_one(result):
    shares = result.eigenmodes.filter(like="_share")
    assert shares.shape[1] == 4
    np.testing.assert_allclose(shares.sum(axis=1), 1.0, atol=1e-8)


def test_prior_shares_of_the_parameters_sum_to_the_calibration_share(result):
    by_eigenmode = result.mode_parameters.groupby("mode")[["share", "prior_share"]].sum()
    np.testing.assert_allclose(by_eigenmode["share"], 1.0)
    expected = result.eigenmodes["calibration_share"].head(len(by_eigenmode))
    np.testing.assert_allclose(by_eigenmode["prior_share"], expected, atol=1e-8)


def test_parameters_are_in_the_order_of_the_calibration_table(result):
    columns = ["group", "element", "label", "unit"]
    first = result.mode_parameters[result.mode_parameters["mode"] == 1]
    pd.testing.assert_frame_equal(
        first[columns].reset_index(drop=True), result.calibration[columns]
    )


def test_shares_are_squared_moves_over_conditional_sigmas(result):
    first = result.mode_parameters[result.mode_parameters["mode"] == 1]
    scaled = first["move"].to_numpy() / result.calibration["sigma_conditional"].to_numpy()
    np.testing.assert_allclose(first["share"], scaled**2 / np.sum(scaled**2), rtol=1e-9)
    assert scaled[np.argmax(np.abs(scaled))] > 0.0


def test_moves_do_not_exceed_the_marginal_sigmas(result):
    moves = result.mode_parameters.pivot(index=["group", "element"], columns="mode", values="move")
    sigma = result.calibration.set_index(["group", "element"])["sigma_marginal"]
    variance = (moves**2).sum(axis=1)
    assert (variance <= (1.0 + 1e-3) * sigma[variance.index] ** 2).all()


def test_shifts_do_not_exceed_the_variance_due_to_the_calibration(result):
    squares = result.mode_shifts.assign(square=result.mode_shifts["shift_ra"] ** 2)
    variance = squares.groupby("source_id")["square"].sum().to_numpy()
    by_calibration = (
        result.sources["sigma_ra_marginal"] ** 2 - result.sources["sigma_ra_conditional"] ** 2
    ).to_numpy()
    assert (variance <= (1.0 + 1e-3) * by_calibration).all()
    assert variance.min() > 0.0


def test_common_shifts_of_detectors_and_pointings_form_one_eigenmode(result):
    named = result.eigenmodes["name"].head(MAX_NAMED)
    for axis in "xy":
        both = named.str.contains(f"common detector {axis}") | named.str.contains(
            f"pointing.* and detector {axis}"
        )
        assert (both & named.str.contains("pointing")).any()
