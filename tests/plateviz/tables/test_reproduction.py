"""The paper's numbers beside ours: which number is compared, and the ratio."""

import numpy as np
import pandas as pd
import pytest

from plateviz.tables.reproduction import COLUMNS, SurveyFigures, reproduction
from solver.data.survey_schema import ERRORS_BY_COUNT, MOTIONS, RUN_ORBITS


@pytest.fixture
def figures():
    orbits = pd.DataFrame({c: [1.0, 1.0] for c in RUN_ORBITS.names})
    orbits = orbits.assign(residual_rms_x=0.01, residual_rms_y=0.01, seconds=[6.0, 12.0])
    motions = pd.DataFrame({c: np.zeros(4) for c in MOTIONS.names})
    motions = motions.assign(
        is_reference=[True, False, False, False],
        is_artificial=[False, False, True, False],
        n_orbits=[90, 90, 90, 80],
        rms_truth_2d=[0.3, 0.7, 0.75, 99.0],
        scatter_ra=0.03,
        scatter_dec=0.03,
    )
    errors = pd.DataFrame(
        {
            **{c: [0.1, 0.07, 0.01] for c in ERRORS_BY_COUNT.names},
            "n_orbits": [40, 80, 90],
            "n_sources": [1000, 200, 3],
        }
    )
    classes = pd.DataFrame(
        {
            "rms_deviation": [0.4, 0.9],
            "rms_prior_sigma": [0.4, 1000.0],
            "sigma_single": [1.0, 4.0],
            "sigma_often": [0.11, 0.5],
        },
        index=["reference", "non-reference"],
    )
    return SurveyFigures(orbits, motions, errors, classes, 400.0)


def test_every_quantity_has_both_numbers(figures):
    table = reproduction(figures)
    assert list(table.columns) == COLUMNS
    assert table[["paper_low", "paper_high", "ours", "ratio"]].notna().all(axis=None)


@pytest.mark.parametrize(
    ("quantity", "ours", "ratio"),
    [
        ("rms separation, reference", 300.0, 1.0),
        ("scatter, reference", 30.0, 1.0),
        ("reported sigma, reference", 110.0, 1.1),
        ("on-sky deviation, non-reference", 0.9, 0.9),
        ("orbits per source near the target", 90.0, 1.0),
        ("time per orbit", 0.15, 0.003),
    ],
)
def test_ratio_is_to_the_number_or_to_the_nearer_end_of_the_range(figures, quantity, ours, ratio):
    row = reproduction(figures).set_index("quantity").loc[quantity]
    assert row["ours"] == pytest.approx(ours)
    assert row["ratio"] == pytest.approx(ratio)


def test_separations_are_compared_in_2d_and_in_one_coordinate(figures):
    rows = reproduction(figures).set_index("quantity")
    for name, both in (("non-reference", 700.0), ("artificial", 750.0)):
        found = rows.loc[f"rms separation, {name}"]
        assert found["ours"].tolist() == pytest.approx([both, both / np.sqrt(2.0)])


def test_residuals_are_compared_in_pixels_and_on_the_sky(figures):
    rows = reproduction(figures).set_index("quantity").loc["residual scatter"]
    assert rows["ours"].tolist() == pytest.approx([0.01, 4.0])


def test_error_is_that_of_the_largest_orbit_count_with_enough_sources(figures):
    rows = reproduction(figures).set_index("quantity").loc["error of artificial sources"]
    assert rows["reading"].str.contains("80 orbits").all()
    assert rows["ours"].tolist() == pytest.approx([70.0, 70.0])


def test_survey_without_a_class_has_no_numbers_for_it(figures):
    few = SurveyFigures(
        figures.orbits,
        figures.motions.iloc[1:],
        figures.errors.iloc[:0],
        figures.classes.loc[["non-reference"]],
        400.0,
    )
    table = reproduction(few).set_index("quantity")
    assert np.isnan(table.loc["rms separation, reference", "ours"])
    assert "error of artificial sources" not in table.index
