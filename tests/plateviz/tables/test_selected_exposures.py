"""The lists of the selected exposures and detectors."""

import numpy as np

from plateviz.tables import selected_detectors, selected_exposures
from plateviz.tables.headings import SELECTED_DETECTORS, SELECTED_EXPOSURES


def test_exposures_have_the_values_of_the_solution(fit_result):
    table = selected_exposures({(1, 0), (0, 1), (99, 0)}, fit_result)
    assert list(table) == list(SELECTED_EXPOSURES)
    assert table[["field_id", "plate_id"]].to_numpy().tolist() == [[0, 1], [1, 0]]
    rows = fit_result.exposures.set_index(["field_id", "plate_id"]).loc[(0, 1)]
    assert table["n_obs"].iloc[0] == rows["n_obs"]
    assert table["chi2_per_dof"].iloc[0] == rows["chi2"] / rows["dof"]


def test_detectors_have_the_rms_of_their_measurements(fit_result):
    table = selected_detectors({3, 1, 99}, fit_result)
    assert list(table) == list(SELECTED_DETECTORS)
    assert table["detector_id"].tolist() == [1, 3]
    rows = fit_result.residuals[fit_result.residuals["detector_id"] == 3]
    assert table["n_obs"].iloc[1] == len(rows)
    rms = np.sqrt(np.mean(rows["standardised_x"] ** 2))
    assert np.isclose(table["rms_x"].iloc[1], rms, rtol=1e-12)


def test_nothing_is_listed_of_nothing(fit_result):
    assert selected_exposures({(0, 1)}, None).empty
    assert selected_detectors({1}, None).empty
    assert selected_detectors(set(), fit_result).empty
    assert list(selected_detectors(set(), fit_result)) == list(SELECTED_DETECTORS)
