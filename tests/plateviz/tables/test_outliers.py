"""The list of outliers, and which of them have each other's identification."""

from dataclasses import replace

import numpy as np

from plateviz.reports.orbit import orbit_report
from plateviz.tables.outliers import EXCHANGED, outlier_list, swapped_with
from plateviz.verdict.verdict import orbit_verdict
from solver.data.instrument import MINI_MOCK

SIGMA = 0.01


def outliers_at(fit_result, places, shifts):
    """Return outliers of one exposure, each where another of them should be, with a shift."""
    rows = fit_result.residuals.head(len(places)).assign(field_id=0, plate_id=0, detector_id=0)
    at = rows[["model_x", "model_y"]].to_numpy()
    measured = at[places] + shifts
    residual = measured - at
    return rows.assign(
        nx=measured[:, 0],
        ny=measured[:, 1],
        residual_x=residual[:, 0],
        residual_y=residual[:, 1],
        distance=np.hypot(*residual.T) / SIGMA,
        shift_ra=1.0,
        shift_dec=1.0,
    )


def one_pair(fit_result):
    shifts = [[0.0, 0.0], [0.3, 0.0], [0.0, 0.0], [0.0, -0.4]]
    return outliers_at(fit_result, [2, 1, 0, 3], shifts)


def test_swapped_outliers_are_found_with_each_other(fit_result):
    outliers = one_pair(fit_result)
    assert swapped_with(outliers).tolist() == [2, -1, 0, -1]
    assert swapped_with(outliers.assign(detector_id=[0, 0, 1, 0])).tolist() == [-1] * 4
    assert swapped_with(outliers.head(0)).tolist() == []


def test_outlier_at_the_place_of_a_good_measurement_has_no_other_one(fit_result):
    still = np.full((3, 2), 0.5 * SIGMA)
    # A cycle: each is where the next one should be, and no two are in each other's place.
    assert swapped_with(outliers_at(fit_result, [1, 2, 0], still)).tolist() == [-1] * 3


def test_each_outlier_is_in_one_pair_at_most(fit_result):
    outliers = one_pair(fit_result)
    # The third and the fourth are both where the first should be; the third is nearer.
    outliers.iloc[3] = outliers.iloc[2]
    for column in ("nx", "residual_x"):
        outliers.iloc[3, outliers.columns.get_loc(column)] += SIGMA
    assert swapped_with(outliers).tolist() == [2, -1, 0, -1]


def test_list_of_outliers_names_the_source_of_the_exchange(fit_result):
    outliers = one_pair(fit_result).reset_index(drop=True)
    ids = outliers["source_id"].astype(str).tolist()
    table = outlier_list(replace(fit_result, outliers=outliers))
    assert table["source"].tolist() == ids
    assert table[EXCHANGED].tolist() == [ids[2], "", ids[0], ""]
    nothing = outlier_list(replace(fit_result, outliers=outliers.head(0)))
    assert nothing.empty
    assert list(nothing) == list(table)
    assert outlier_list(fit_result) is None


def test_report_has_the_exchange_beside_each_outlier(fit_result):
    outliers = one_pair(fit_result).reset_index(drop=True)
    report = orbit_report(replace(fit_result, outliers=outliers), MINI_MOCK, {})
    assert EXCHANGED in report.tables["Outliers (4)"]


def test_outliers_with_each_others_identification_are_counted(fit_result):
    notable = orbit_verdict(replace(fit_result, outliers=one_pair(fit_result))).notable
    assert any("outliers: 4. 2 of them have each other's" in sentence for sentence in notable)
