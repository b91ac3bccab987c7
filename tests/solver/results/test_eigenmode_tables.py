"""The tables of the modes of a fit, complete and consistent with each other."""

import numpy as np
import pandas as pd
import pytest

from solver.data.schema import EIGENMODE_TABLES
from solver.results.eigenmodes import MOST_WEAK, WEAK


@pytest.mark.parametrize("table", EIGENMODE_TABLES, ids=lambda table: table.name)
def test_columns_are_those_of_the_schema(result, table):
    frame = getattr(result, table.name)
    assert list(frame.columns) == table.names
    assert not frame.isna().any(axis=None)
    assert not frame.duplicated(list(table.key)).any()


def test_there_are_as_many_modes_as_parameters(result):
    assert len(result.modes) == len(result.calibration)
    assert result.modes["mode"].tolist() == list(range(1, len(result.calibration) + 1))


def test_the_weak_modes_are_named(result):
    weak = result.modes["data_share"] < WEAK
    named = result.modes["name"] != ""
    assert named.sum() == min(weak.sum(), MOST_WEAK) > 3
    assert weak[named].all()


def test_shares_of_a_mode_add_up_to_one(result):
    shares = result.modes.filter(like="_share")
    assert shares.shape[1] == 4
    np.testing.assert_allclose(shares.sum(axis=1), 1.0, atol=1e-8)


def test_priors_of_the_parameters_add_up_to_the_share_of_the_calibration(result):
    by_mode = result.mode_parameters.groupby("mode")[["share", "prior_share"]].sum()
    np.testing.assert_allclose(by_mode["share"], 1.0)
    expected = result.modes["calibration_share"].head(len(by_mode))
    np.testing.assert_allclose(by_mode["prior_share"], expected, atol=1e-8)


def test_parameters_stand_as_in_the_table_of_the_calibration(result):
    columns = ["group", "element", "label", "unit"]
    first = result.mode_parameters[result.mode_parameters["mode"] == 1]
    pd.testing.assert_frame_equal(
        first[columns].reset_index(drop=True), result.calibration[columns]
    )


def test_shares_are_of_moves_over_conditional_sigmas(result):
    first = result.mode_parameters[result.mode_parameters["mode"] == 1]
    scaled = first["move"].to_numpy() / result.calibration["sigma_conditional"].to_numpy()
    np.testing.assert_allclose(first["share"], scaled**2 / np.sum(scaled**2), rtol=1e-9)
    assert scaled[np.argmax(np.abs(scaled))] > 0.0


def test_no_mode_moves_a_parameter_by_more_than_its_marginal_sigma(result):
    moves = result.mode_parameters.pivot(index=["group", "element"], columns="mode", values="move")
    sigma = result.calibration.set_index(["group", "element"])["sigma_marginal"]
    variance = (moves**2).sum(axis=1)
    assert (variance <= (1.0 + 1e-3) * sigma[variance.index] ** 2).all()


def test_shifts_are_a_part_of_the_marginal_covariance(result):
    squares = result.mode_shifts.assign(square=result.mode_shifts["shift_ra"] ** 2)
    variance = squares.groupby("source_id")["square"].sum().to_numpy()
    by_calibration = (
        result.sources["sigma_ra_marginal"] ** 2 - result.sources["sigma_ra_conditional"] ** 2
    ).to_numpy()
    assert (variance <= (1.0 + 1e-3) * by_calibration).all()
    assert variance.min() > 0.0


def test_common_shift_of_the_detectors_comes_out_with_that_of_the_pointings(result):
    named = result.modes["name"].head(MOST_WEAK)
    for axis in "xy":
        both = named.str.contains(f"common detector {axis}") | named.str.contains(
            f"pointing.* and detector {axis}"
        )
        assert (both & named.str.contains("pointing")).any()
