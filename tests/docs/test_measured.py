"""The table of the paper's numbers has the rows that `plateviz reproduce` prints."""

import re

import numpy as np
import pandas as pd

from plateviz.tables.reproduction import SurveyFigures, reproduction
from solver.data.survey_schema import ERRORS_BY_COUNT, MOTIONS, RUN_ORBITS
from tests.docs.pages import DOCS

PAGE = (DOCS / "measured.md").read_text("utf-8")
BLOCK = re.search(r"<!-- reproduce:begin -->\n(.*?)<!-- reproduce:end -->", PAGE, re.DOTALL)[1]


def test_page_has_the_quantities_and_the_numbers_of_the_paper():
    _, _, *lines = BLOCK.splitlines()
    cells = [[cell.strip() for cell in line.strip("|").split("|")] for line in lines]
    table = reproduction(_figures())
    papers = [
        f"{low:.3g}" if low == high else f"{low:.3g} to {high:.3g}"
        for low, high in zip(table["paper_low"], table["paper_high"], strict=True)
    ]
    assert [row[0] for row in cells] == list(table["quantity"])
    assert [row[4] for row in cells] == list(table["unit"])
    # The law at 90 orbits scales with the number of orbits that the survey has.
    law = "the law at 90 orbits"
    assert [row[2] for row in cells if row[1] != law] == [
        paper for paper, reading in zip(papers, table["reading"], strict=True) if reading != law
    ]


def _figures():
    orbits = pd.DataFrame({name: [1.0, 1.0] for name in RUN_ORBITS.names})
    motions = pd.DataFrame({name: np.zeros(4) for name in MOTIONS.names}).assign(
        is_reference=[True, False, False, False],
        is_artificial=[False, False, True, False],
        n_orbits=[90, 90, 90, 80],
    )
    errors = pd.DataFrame({name: [0.1] for name in ERRORS_BY_COUNT.names}).assign(
        n_orbits=90, n_sources=200
    )
    columns = ("rms_deviation", "rms_prior_sigma", "sigma_single", "sigma_often")
    kinds = ["reference", "non-reference"]
    classes = pd.DataFrame({name: [1.0, 1.0] for name in columns}, index=kinds)
    return SurveyFigures(orbits, motions, errors, classes, 400.0)
