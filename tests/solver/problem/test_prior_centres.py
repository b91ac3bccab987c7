import numpy as np
import pytest

from solver.data.distortion_terms import terms
from solver.data.parameters import BY_NAME
from solver.data.settings import FitSettings
from solver.errors import InputError
from solver.fit import fit_orbit
from solver.model.astrometry import sky_position
from solver.problem.problem import build_problem


def built(orbit, **shifts):
    names = {name.replace("__", "[") + "]" * ("__" in name): s for name, s in shifts.items()}
    return build_problem(orbit.data, orbit.instrument, FitSettings(prior_shifts=names))


def centres(problem, group):
    return problem.priors.centre[problem.layout.columns(BY_NAME[group])]


@pytest.mark.parametrize("group", ["position_angle", "focal_length", "detector_x", "pitch_y"])
def test_shift_of_a_group_moves_all_its_centres(small_orbit, group):
    moved = centres(built(small_orbit, **{group: 0.25}), group) - centres(built(small_orbit), group)
    np.testing.assert_allclose(moved, 0.25, rtol=1e-6)


@pytest.mark.parametrize(
    ("group", "element", "place"),
    [
        ("focal_length", "1/2", 6),
        ("detector_y", "3", 3),
        ("distortion_x", "3/0", terms(5).index((3, 0))),
    ],
)
def test_shift_of_an_element_moves_only_its_centre(small_orbit, group, element, place):
    shifts = {f"{group}[{element}]": 2.0}
    problem = build_problem(
        small_orbit.data, small_orbit.instrument, FitSettings(prior_shifts=shifts)
    )
    moved = centres(problem, group) - centres(built(small_orbit), group)
    np.testing.assert_allclose(moved, 2.0 * (np.arange(len(moved)) == place), atol=1e-9)


def test_shift_of_the_pointing_is_a_distance_on_the_sky(small_orbit):
    before, after = (
        build_problem(small_orbit.data, small_orbit.instrument, FitSettings(prior_shifts=shifts))
        for shifts in ({}, {"pointing_ra": 30.0, "pointing_dec": -40.0})
    )
    first, second = (p.geometry.pointing_frame[:, 0] for p in (before, after))
    np.testing.assert_allclose(
        np.degrees(np.linalg.norm(first - second, axis=1)) * 3600.0, 50.0, rtol=1e-4
    )


def test_shift_of_the_catalogue_moves_the_priors_of_all_sources(small_orbit):
    shifts = {"sources[ra]": 2.0, "sources[dec]": -3.0}
    frame = build_problem(
        small_orbit.data, small_orbit.instrument, FitSettings(prior_shifts=shifts)
    ).geometry.source_frame
    (ra, dec), (old_ra, old_dec) = map(
        sky_position, (frame[:, 0], built(small_orbit).geometry.source_frame[:, 0])
    )
    np.testing.assert_allclose((ra - old_ra) * np.cos(np.radians(dec)) * 3.6e6, 2.0, rtol=1e-5)
    np.testing.assert_allclose((dec - old_dec) * 3.6e6, -3.0, rtol=1e-5)


def test_solution_follows_the_catalogue(small_orbit, result):
    """Shifting the whole catalogue shifts every source and leaves the residuals unchanged."""
    settings = FitSettings(prior_shifts={"sources[dec]": 5.0})
    shifted = fit_orbit(small_orbit.data, small_orbit.instrument, settings)
    moved = (shifted.sources["dec"] - result.sources["dec"]) * 3.6e6
    np.testing.assert_allclose(moved, 5.0, atol=0.05)
    assert shifted.summary["chi2"] == pytest.approx(result.summary["chi2"], rel=1e-3)


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("detector_x[9]", "found '9'"),
        ("focal_length[5/0]", "0/0, 0/1, .*1/3"),
        ("distortion_x[9/9]", "found '9/9'"),
    ],
)
def test_unknown_element_is_refused(small_orbit, name, message):
    with pytest.raises(InputError, match=message):
        built(small_orbit, **{name.replace("[", "__").rstrip("]"): 1.0})
