"""Places and vectors of maps of the sky, where right ascensions turn and where they are close."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from plateviz import tables
from plateviz.tables.sky import centre_of, places_arcmin
from solver.model.astrometry import sky_position
from solver.model.directions import tangent_frame, vectors_about

ARCMIN = np.radians(1.0 / 60.0)


def about(ra, dec):
    """Directions 20 arcmin to all sides of a centre, and their true places in its plane."""
    angle = np.arange(12) * 2.0 * np.pi / 12
    places = 20.0 * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    frame = tangent_frame(np.array([ra]), np.array([dec]))[0]
    ra, dec = sky_position(frame[0] + ARCMIN * places @ frame[1:])
    return pd.DataFrame({"ra": ra, "dec": dec}), places


@pytest.mark.parametrize("centre", [(266.4, -29.0), (0.0, 10.0), (40.0, 89.95), (120.0, -89.99)])
def test_places_are_those_on_the_tangent_plane(centre):
    rows, places = about(*centre)
    assert centre_of(rows)[1] == pytest.approx(centre[1], abs=1e-3)
    np.testing.assert_allclose(np.stack(places_arcmin(rows, centre), axis=1), places, atol=1e-9)


@pytest.mark.parametrize("centre", [(266.4, -29.0), (40.0, 89.95)])
def test_a_common_motion_has_one_direction_in_the_plane(centre):
    rows, places = about(*centre)
    frame = tangent_frame(np.array([centre[0]]), np.array([centre[1]]))[0]
    shift = 1e-3 * np.array([1.0, 2.0])
    ra, dec = sky_position(frame[0] + ARCMIN * (places + shift) @ frame[1:])
    local = tangent_frame(rows["ra"].to_numpy(), rows["dec"].to_numpy())
    moved = tangent_frame(ra, dec)[:, 0] - local[:, 0]
    east, north = (np.einsum("nk,nk->n", moved, local[:, k]) / ARCMIN for k in (1, 2))
    found = vectors_about(centre, rows["ra"].to_numpy(), rows["dec"].to_numpy(), east, north)
    np.testing.assert_allclose(found, np.tile(shift, (len(rows), 1)), rtol=1e-3)


def test_arrows_of_a_comparison_near_a_pole_point_one_way(fit_result):
    rows, places = about(40.0, 89.95)
    count = len(rows)
    frame = tangent_frame(np.array([40.0]), np.array([89.95]))[0]
    ra, dec = sky_position(frame[0] + ARCMIN * (places + [1e-4, 0.0]) @ frame[1:])
    first = fit_result.sources.head(count)
    a = replace(fit_result, sources=first.assign(**{n: rows[n].to_numpy() for n in rows}))
    b = replace(fit_result, sources=first.assign(ra=ra, dec=dec))
    table = tables.comparison(a, b)
    np.testing.assert_allclose(np.hypot(table["u_arcmin"], table["v_arcmin"]), 1e-4, rtol=1e-3)
    turned = np.arctan2(table["v_arcmin"], table["u_arcmin"])
    assert np.ptp(turned) < 0.01
