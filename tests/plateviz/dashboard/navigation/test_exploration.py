"""What the Explore workspace draws, and that its address says it."""

import math

import pytest

from plateviz.dashboard.navigation.exploration import Exploration

TABLES = ["measurements", "sources", "exposures"]
COLUMNS = ["ra", "dec", "n_obs", "sigma_ra_marginal"]


@pytest.fixture
def exploration():
    made = Exploration(TABLES)
    made.table = "sources"
    made.offer(COLUMNS)
    return made


def test_first_columns_are_those_of_the_table(exploration):
    assert (exploration.x, exploration.y) == ("n_obs", "sigma_ra_marginal")
    assert exploration.columns().colour == ""


def test_column_that_the_next_table_lacks_is_replaced(exploration):
    exploration.param.update(x="dec", colour="ra", only="n_obs", lowest=2.0, highest=3.0)
    exploration.table = "exposures"
    exploration.offer(["minutes", "chi2_per_dof", "dec"])
    assert (exploration.x, exploration.y) == ("dec", "chi2_per_dof")
    assert exploration.columns().colour == exploration.columns().only == ""
    assert exploration.columns().lowest == -math.inf


def test_zoom_is_forgotten_with_other_columns_only(exploration):
    exploration.limits = ((0.0, 1.0), (2.0, 3.0))
    exploration.param.update(colour="ra", only="n_obs")
    assert exploration.limits == ((0.0, 1.0), (2.0, 3.0))
    exploration.x = "dec"
    assert exploration.limits is None


@pytest.mark.parametrize(
    "between", [(2.5, 30.0), (-math.inf, 61_822.123456789), (1e-7 / 3.0, math.inf)]
)
def test_address_is_read_back(exploration, between):
    exploration.param.update(y="dec", colour="ra", only="n_obs", is_log_x=True, has_median=True)
    exploration.param.update(lowest=between[0], highest=between[1], selects="detectors")
    exploration.limits = ((1.0, 20.0), (-0.5, 1.5e-3 / 7.0))
    other = Exploration(TABLES)
    assert other.restore(exploration.address()) == []
    assert other.offer(COLUMNS) == []
    assert other.table == "sources"
    assert other.columns() == exploration.columns()
    assert other.address() == exploration.address()


def test_columns_without_a_table_are_those_of_the_one_that_is_drawn(exploration):
    assert exploration.restore({"x": "dec", "y": "nope"}) == []
    (told,) = exploration.offer(COLUMNS)
    assert told == "y: expected a column of the sources, found 'nope'"
    assert (exploration.table, exploration.x) == ("sources", "dec")


def test_table_has_its_former_name_in_older_addresses(exploration):
    assert exploration.restore({"rows": "residuals", "x": "dec"}) == []
    assert exploration.table == "measurements"


@pytest.mark.parametrize(
    ("nonsense", "told"),
    [
        ({"rows": "nothing", "x": "dec"}, ["rows: expected measurements, sources"]),
        (
            {"rows": "sources", "x": "<b>", "y": "", "colour": "../..", "only": "0"},
            [f"{name}: expected a column of the sources" for name in ("x", "y", "colour", "only")],
        ),
        ({"rows": "sources", "zoom": "1~inf~2~3"}, ["zoom: expected 4 numbers"]),
        ({"rows": "sources", "zoom": "1~2~3"}, ["zoom: expected 4 numbers"]),
        ({"rows": "sources", "zoom": "nan~1e999~3~4"}, ["zoom: expected 4 numbers"]),
        (
            {"rows": "sources", "with": "log x,table", "between": "a~b", "selects": "limits"},
            [
                "selects: expected sources, exposures, detectors",
                "with: expected is_log_x",
                "with: expected is_log_x",
                "between: expected 2 numbers",
            ],
        ),
    ],
)
def test_nonsense_in_an_address_is_ignored_and_told(nonsense, told):
    found, expected = Exploration(TABLES), Exploration(TABLES)
    expected.table = "sources" if nonsense["rows"] == "sources" else TABLES[0]
    problems = found.restore(nonsense)
    for one in (found, expected):
        problems += one.offer(COLUMNS)
    assert found.columns() == expected.columns()
    assert len(problems) == len(told)
    assert all(map(str.startswith, problems, told))


def test_address_is_empty_before_the_columns_are_known():
    assert Exploration(TABLES).address() == {}
