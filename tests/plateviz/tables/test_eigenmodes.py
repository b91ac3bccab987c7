"""Tables of the eigenmodes and of the prior shares."""

from dataclasses import replace

import numpy as np
import pytest

from plateviz import tables
from plateviz.tables.eigenmodes import DECIDERS


def test_spectrum_has_every_eigenmode_and_marks_the_weak_ones(fit_result):
    table = tables.eigenmode_spectrum(fit_result)
    assert len(table) == len(fit_result.eigenmodes)
    assert table.loc[table["is_weak"], "mode"].tolist() == [1, 2, 3]


def test_parts_of_a_bar_fill_it_in_the_order_of_the_deciders(fit_result):
    for _, rows in tables.eigenmode_deciders(fit_result).groupby("mode"):
        assert rows["left"].iloc[0] == 0.0
        assert rows["right"].iloc[-1] == pytest.approx(1.0)
        assert np.allclose(rows["left"].iloc[1:], rows["right"].iloc[:-1])
        assert rows["decider"].map(DECIDERS.index).is_monotonic_increasing


def test_priors_of_the_calibration_are_listed_by_group(fit_result):
    table = tables.eigenmode_deciders(fit_result)
    first = table[table["mode"] == 1]
    assert first["what"].tolist() == ["prior of detector x"]
    assert first["share"].tolist() == [pytest.approx(1.0)]


def test_shares_of_the_groups_add_up_to_one(fit_result):
    table = tables.eigenmode_groups(fit_result)
    assert np.allclose(table.groupby("mode")["share"].sum(), 1.0)
    assert table["group"].nunique() == fit_result.calibration["group"].nunique()


def test_moves_of_the_groups_are_rms_in_their_unit(fit_result):
    rows = fit_result.mode_parameters
    here = rows[(rows["mode"] == 2) & (rows["group"] == "detector_y")]
    table = tables.eigenmode_groups(fit_result)
    found = table[(table["mode"] == 2) & (table["group"] == "detector y")].iloc[0]
    assert found["move"] == pytest.approx(np.sqrt((here["move"] ** 2).mean()))
    assert found["unit"] == "µm"
    assert found["shift_mas"] == pytest.approx(np.hypot(0.04, 0.01))


def test_shifts_have_source_positions_and_lengths_in_arcmin(fit_result):
    table = tables.eigenmode_shifts(fit_result)
    assert len(table) == len(fit_result.mode_shifts)
    length = np.hypot(table["shift_ra_mas"], table["shift_dec_mas"])
    assert np.allclose(np.hypot(table["u"], table["v"]) * 60_000.0, length, rtol=1e-3)
    # East of a source hardly differs from that of the centre, this far from a pole.
    assert np.abs(table["u"] * 60_000.0 - table["shift_ra_mas"]).max() < 0.02 * length.max()
    assert set(table["id"]) == set(fit_result.sources["source_id"].astype(str))
    assert np.abs(table["x"]).max() < 30.0


def test_only_the_eigenmodes_with_the_largest_shifts_are_mapped(fit_result):
    assert tables.eigenmode_shifts(fit_result, most=1)["mode"].unique().tolist() == [3]
    # The rms shift of the first is 1/400 of that of the third.
    assert tables.eigenmode_shifts(fit_result, most=3)["mode"].unique().tolist() == [2, 3]


@pytest.mark.parametrize(
    "table",
    [
        tables.eigenmode_spectrum,
        tables.eigenmode_deciders,
        tables.eigenmode_groups,
        tables.eigenmode_shifts,
    ],
    ids=lambda table: table.__name__,
)
def test_result_without_eigenmodes_has_no_rows_and_all_columns(fit_result, table):
    old = replace(fit_result, eigenmodes=None, mode_parameters=None, mode_shifts=None)
    assert table(old).empty
    assert list(table(old).columns) == list(table(fit_result).columns)


def test_prior_shares_equal_those_of_the_calibration_with_a_row_per_group(fit_result):
    table = tables.prior_shares(fit_result)
    assert table["prior_share"].tolist() == fit_result.calibration["prior_share"].tolist()
    assert table.groupby("row")["group"].nunique().eq(1).all()
    assert (np.abs(table["height"] - table["row"]) < 0.5).all()
    assert table["group"].iloc[0] == "pointing RA"
