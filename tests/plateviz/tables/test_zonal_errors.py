"""The field of smooth errors: its places, its values, and their scatter by chance."""

import numpy as np
import pytest

from plateviz import tables
from tests.plateviz.run_tables import zonal


def of_terms(terms, **scatter):
    """Return a field with coefficients by (axis, degree to the East, degree to the North)."""
    table = zonal(30.0)
    place = [*zip(table["axis"], table["degree_ra"], table["degree_dec"], strict=True)]
    parts = [name for name in table.columns if name.startswith("scatter_")]
    table[parts] = 0.0
    table["coefficient"] = [terms.get(term, 0.0) for term in place]
    for name, value in scatter.items():
        table[name] = value
    return table


def test_field_is_the_polynomial_of_its_coefficients():
    found = tables.zonal_errors(of_terms({("ra", 1, 0): 2.0, ("dec", 1, 2): -3.0}))
    east, north = found[["east_deg", "north_deg"]].to_numpy().T
    assert found["error_ra_mas"].to_numpy() == pytest.approx(2.0 * east)
    assert found["error_dec_mas"].to_numpy() == pytest.approx(-3.0 * east * north**2)


def test_parts_of_the_scatter_add_in_squares():
    one = of_terms({}, scatter_00=0.3)
    found = tables.zonal_errors(one.assign(scatter_01=0.4))
    monomials = sum(
        found["east_deg"] ** i * found["north_deg"] ** j
        for i, j in one.loc[one["axis"] == "ra", ["degree_ra", "degree_dec"]].to_numpy()
    )
    assert found["sigma_ra_mas"].to_numpy() == pytest.approx(0.5 * np.abs(monomials.to_numpy()))


def test_places_fill_the_area_evenly():
    found = tables.zonal_errors(zonal(30.0).assign(half_ra=0.6, half_dec=0.3))
    steps = np.diff(np.unique(found["east_deg"]))
    assert steps == pytest.approx(steps[0])
    assert np.diff(np.unique(found["north_deg"])) == pytest.approx(steps[0], rel=0.2)
    assert found["east_deg"].max() == pytest.approx(0.6 - 0.5 * steps[0])
    assert found["north_deg"].abs().max() < 0.3


def test_statistics_say_what_chance_does():
    found = tables.zonal_statistics(zonal(30.0))
    assert (found.chi2, found.dof, found.scatter) == (30.0, 12.0, pytest.approx(24.0**0.5))
    assert (found.rms_mas, found.typical_mas) == (0.4, 0.15)


def test_untested_run_has_no_rows():
    assert tables.zonal_errors(zonal(30.0).head(0)).empty
