"""Statistics of one orbit about errors of the catalogue, against fits with such errors."""

from dataclasses import replace

import numpy as np
import pytest

from solver.data.run_schema import FIELD_DEGREES, FRAME_DEGREES, SKY_RESPONSES, SKY_STATISTICS
from solver.data.settings import FitSettings
from solver.fit import OrbitFitter
from solver.model.directions import places_about
from solver.results.catalogue_response import polynomial_fields
from solver.units import MAS_PER_DEG

N_TERMS, N_FRAME, N_FIELDS = 6, 2 * len(FRAME_DEGREES), 2 * len(FIELD_DEGREES)
# Converged so far that differences of 1 mas of the catalogue can be compared.
SETTINGS = FitSettings(tolerance=1e-6)
ERROR_MAS = 1.0


def fitted(orbit, catalogue=None, settings=SETTINGS):
    data = orbit.data if catalogue is None else replace(orbit.data, catalogue=catalogue)
    fitter = OrbitFitter(data, orbit.instrument)
    result = fitter.fit(settings)
    return result, fitter.sky_statistics(result)


@pytest.fixture(scope="module")
def statistics(small_orbit):
    return fitted(small_orbit)[1]


def numbered(table, name):
    return table[[column for column in table if column.startswith(f"{name}_")]].to_numpy()


def test_tables_have_the_columns_of_the_schema(statistics):
    assert list(statistics["sky_statistics"]) == SKY_STATISTICS.names
    assert list(statistics["sky_responses"]) == SKY_RESPONSES.names
    counts = statistics["sky_statistics"]["kind"].value_counts()
    assert dict(counts) == {"distortion": N_TERMS, "frame": N_FRAME, "field": N_FIELDS}


@pytest.mark.parametrize("field", [3, 14])
def test_response_is_that_of_a_fit_with_another_catalogue(small_orbit, statistics, field):
    table = statistics["sky_statistics"]
    before, _ = fitted(small_orbit)
    moved = with_field(small_orbit, table, field)
    after, changed = fitted(small_orbit, moved)
    expected = ERROR_MAS * table[f"field_{field:02d}"].to_numpy()
    found = changed["sky_statistics"]["value"].to_numpy() - table["value"].to_numpy()
    is_frame = (table["kind"] == "frame").to_numpy()
    found[is_frame] = followed_frame(before, after, table)
    for kind in table["kind"].unique():
        rows = (table["kind"] == kind).to_numpy()
        # The model is not quite linear.
        atol = 0.02 * np.abs(expected[rows]).max()
        np.testing.assert_allclose(found[rows], expected[rows], atol=atol)


def with_field(orbit, table, field):
    """Return the catalogue with the reference stars displaced along a field."""
    reference = orbit.data.catalogue.copy()
    at = places_about(centre_of(table), reference["ra"].to_numpy(), reference["dec"].to_numpy())
    shift = ERROR_MAS / MAS_PER_DEG * polynomial_fields(at, FIELD_DEGREES)[field]
    shift *= reference["is_reference"].to_numpy()[:, None]
    reference["ra"] += shift[:, 0] / np.cos(np.radians(reference["dec"]))
    reference["dec"] += shift[:, 1]
    return reference


def centre_of(table):
    return float(table["centre_ra"].iloc[0]), float(table["centre_dec"].iloc[0])


def followed_frame(before, after, table):
    """Return the polynomial that fits how the other sources move, by their conditional weights."""
    rows = ~before.sources["is_reference"].to_numpy()
    names = ["offset_ra", "offset_dec"]
    shift = (after.sources[names] - before.sources[names]).to_numpy()[rows]
    sources = before.sources[rows]
    at = places_about(centre_of(table), sources["ra"].to_numpy(), sources["dec"].to_numpy())
    sigma = sources[["sigma_ra_conditional", "sigma_dec_conditional"]].to_numpy()
    covariance = sigma[:, :, None] * sigma[:, None, :]
    covariance[:, [0, 1], [1, 0]] *= sources["corr_conditional"].to_numpy()[:, None]
    root = np.linalg.cholesky(np.linalg.inv(covariance))
    fields = np.einsum("sji,fsj->fsi", root, polynomial_fields(at, FRAME_DEGREES))
    whitened = np.einsum("sji,sj->si", root, shift)
    return np.linalg.lstsq(fields.reshape(N_FRAME, -1).T, whitened.ravel(), rcond=None)[0]


def test_fields_respond_as_their_stars_do(small_orbit, statistics):
    """The response to a field is the sum of those of the stars, per sigma of each."""
    table, stars = statistics["sky_statistics"], statistics["sky_responses"]
    by_star = np.stack([numbered(stars, axis) for axis in ("ra", "dec")])
    fitter = OrbitFitter(small_orbit.data, small_orbit.instrument)
    result = fitter.fit(SETTINGS)
    sources = result.sources.set_index("source_id").loc[stars["source_id"]]
    at = places_about(centre_of(table), sources["ra"].to_numpy(), sources["dec"].to_numpy())
    sigma = sources[["prior_sigma_ra", "prior_sigma_dec"]].to_numpy()
    assert (sources["prior_corr"].abs() < 1e-3).all()
    fields = polynomial_fields(at, FIELD_DEGREES) / sigma
    summed = np.einsum("asr,fsa->rf", by_star, fields)
    by_field = numbered(table, "field")
    np.testing.assert_allclose(summed, by_field, atol=1e-3 * np.abs(by_field).max())


def test_covariance_of_the_noise_is_one(statistics):
    noise = numbered(statistics["sky_statistics"], "noise")
    scale = np.sqrt(np.diag(noise))
    np.testing.assert_allclose(noise, noise.T, atol=1e-6 * np.outer(scale, scale).max())
    values = np.linalg.eigvalsh(noise / np.outer(scale, scale))
    assert values.min() > -1e-6 * values.max()


def test_orbit_of_reference_stars_alone_has_none(small_orbit):
    data = small_orbit.data
    is_reference = data.catalogue["is_reference"].to_numpy(bool)
    known = data.catalogue.loc[is_reference, "source_id"]
    of_known = data.measurements["source_id"].isin(known)
    few = replace(
        data,
        catalogue=data.catalogue[is_reference].reset_index(drop=True),
        measurements=data.measurements[of_known].reset_index(drop=True),
    )
    fitter = OrbitFitter(few, small_orbit.instrument)
    assert fitter.sky_statistics(fitter.fit(SETTINGS.with_(order=1))) == {}


def test_orbit_without_quadratic_terms_has_fewer_statistics(small_orbit):
    _, found = fitted(small_orbit, settings=SETTINGS.with_(order=1))
    counts = found["sky_statistics"]["kind"].value_counts()
    assert dict(counts) == {"frame": N_FRAME, "field": N_FIELDS}
