"""Tracks of the exposures, against astropy and against the calibration."""

from dataclasses import replace

import numpy as np
import pytest
from astropy.coordinates import SkyCoord

from plateviz import tables
from solver.data.parameters import groups_on
from solver.fit import fit_orbit
from tests.solver.small_orbit import make_orbit


@pytest.fixture(scope="module")
def fitted():
    # Near the pole, where the right ascension alone is far from an offset on the sky.
    return fit_orbit(make_orbit(dec=84.0).data)


def test_every_group_on_the_exposures_has_a_track(fit_result):
    table = tables.exposure_tracks(fit_result)
    assert list(table["group"].unique()) == [group.label for group in groups_on("exp")]
    assert (table.groupby("group").size() == len(fit_result.exposures)).all()


def test_pointing_offsets_are_those_on_the_sky(fitted):
    table = tables.exposure_tracks(fitted)
    rows = {name: table[table["group"] == f"pointing {name}"] for name in ("RA", "Dec")}
    places = {
        name: SkyCoord(rows["RA"][name], rows["Dec"][name], unit="deg")
        for name in ("value", "prior_centre")
    }
    offsets = places["prior_centre"].spherical_offsets_to(places["value"])
    for one, offset in zip(rows.values(), offsets, strict=True):
        assert (one["unit"] == "mas").all()
        assert np.allclose(one["offset"], offset.to_value("mas"), atol=1e-3)
        assert one["offset"].abs().max() > 500.0


def test_sigmas_have_the_unit_of_the_offset(fitted):
    table = tables.exposure_tracks(fitted)
    calibration = fitted.calibration.set_index("group")
    for label, name, factor in (("pointing Dec", "pointing_dec", 1e3), ("focal length", "", 1.0)):
        rows, expected = table[table["group"] == label], calibration.loc[name or "focal_length"]
        for column in ("offset", "sigma_conditional", "sigma_marginal", "prior_sigma"):
            assert np.allclose(rows[column], factor * expected[column])


def test_focal_length_is_in_micrometres(fitted):
    table = tables.exposure_tracks(fitted)
    rows = table[table["group"] == "focal length"]
    assert (rows["unit"] == "µm").all()
    assert np.allclose(rows["offset"], rows["value"] - rows["prior_centre"], atol=1e-6)


def test_time_is_counted_from_the_first_exposure(fit_result):
    table = tables.exposure_tracks(fit_result)
    rows = table[table["group"] == "focal length"]
    assert np.allclose(rows["minutes"], 2e-3 * 1440.0 * np.arange(len(rows)), atol=1e-5)
    assert rows["exposure"].iloc[4] == "field 1, exposure 1"


@pytest.mark.parametrize("time", [np.nan, 61_822.0], ids=["missing", "all the same"])
def test_exposures_without_times_have_numbers(fit_result, time):
    exposures = fit_result.exposures.assign(obstime=time)
    table = tables.exposure_tracks(replace(fit_result, exposures=exposures))
    assert table["minutes"].isna().all()
    assert table["number"].max() == len(exposures)


def test_fit_without_parameters_of_exposures_has_no_tracks(fit_result):
    is_of_exposures = fit_result.calibration["group"].isin([g.name for g in groups_on("exp")])
    without = replace(fit_result, calibration=fit_result.calibration[~is_of_exposures])
    assert tables.exposure_tracks(without).empty
