"""The list of the selected sources."""

import pandas as pd

from plateviz.tables import selected_sources
from plateviz.tables.headings import SELECTED_SOURCES


def counts_of(ids):
    flags = {"is_reference": False, "is_artificial": False}
    return pd.DataFrame({"source_id": ids, **flags, "n_orbits": 3, "n_obs": 9})


def test_values_are_those_of_the_solution(fit_result):
    rows = fit_result.sources.iloc[[5, 2]].sort_values("source_id")
    table = selected_sources(set(rows["source_id"]), fit_result, None)
    assert list(table) == list(SELECTED_SOURCES)
    assert table["id"].tolist() == rows["source_id"].astype(str).tolist()
    assert table["ra"].tolist() == rows["ra"].tolist()
    assert table["chi2_per_dof"].tolist() == (rows["chi2"] / rows["dof"]).tolist()
    assert table["n_orbits"].isna().all()


def test_source_that_only_the_run_has_is_listed_without_values(fit_result):
    first = int(fit_result.sources["source_id"].iloc[0])
    table = selected_sources({first, -5, -6}, fit_result, counts_of([first, -5])).set_index("id")
    assert set(table.index) == {str(first), "-5"}
    assert table["n_orbits"].tolist() == [3, 3]
    assert table["ra"].isna().to_dict() == {str(first): False, "-5": True}


def test_nothing_is_listed_without_a_solution_and_a_run():
    table = selected_sources({5}, None, None)
    assert table.empty
    assert list(table) == list(SELECTED_SOURCES)
