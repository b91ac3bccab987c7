"""Tests of a run on synthetic tables: frames of orbits, smooth errors, and trends."""

import numpy as np
import pandas as pd
import pytest
from scipy.special import chdtri

from solver.data.run_schema import FIELD_DEGREES, FRAME_DEGREES
from solver.model.apparent_motion import motion_design
from solver.model.directions import places_about
from solver.results.catalogue_response import polynomial_fields
from solver.results.diagnosis.survey.calibrations import orbit_calibration
from solver.results.diagnosis.survey.frames import compare_frames
from solver.results.diagnosis.survey.sky_orbit import SkyOrbit, shifted_monomials
from solver.results.diagnosis.survey.trends import all_series, trend_tests
from solver.results.diagnosis.survey.weighted_squares import WeightedSquares
from solver.results.diagnosis.survey.zonal import zonal_field, zonal_test

CENTRE, EPOCHS = (266.0, -29.0), np.linspace(61_800.0, 62_700.0, 9)
N_FRAME, N_FIELDS = 2 * len(FRAME_DEGREES), 2 * len(FIELD_DEGREES)
AREA = np.array([0.5, 0.5])


@pytest.mark.parametrize("degrees", [FRAME_DEGREES, FIELD_DEGREES])
def test_shifted_monomials_are_those_of_the_shifted_place(degrees):
    random = np.random.default_rng(3)
    at, shift = random.uniform(-1.0, 1.0, (20, 2)), np.array([0.3, -0.2])
    coefficients = random.standard_normal(2 * len(degrees))
    expected = np.einsum("f,fsi->si", coefficients, polynomial_fields(at + shift, degrees))
    moved = shifted_monomials(shift, degrees) @ coefficients
    found = np.einsum("f,fsi->si", moved, polynomial_fields(at, degrees))
    np.testing.assert_allclose(found, expected, rtol=1e-12)


def history(frames, sigma, n_stars=60, seed=1):
    """Return a history of stars that all orbits measure, with frames and motions."""
    random = np.random.default_rng(seed)
    ra = CENTRE[0] + random.uniform(-0.4, 0.4, n_stars)
    dec = CENTRE[1] + random.uniform(-0.4, 0.4, n_stars)
    at = places_about(CENTRE, ra, dec)
    motions, parts = random.standard_normal((n_stars, 5)), []
    for orbit, (epoch, frame) in enumerate(zip(EPOCHS, frames, strict=True)):
        design = motion_design(ra, dec, np.full(n_stars, epoch), 2029.0)
        offset = np.einsum("nip,np->ni", design, motions)
        offset += np.einsum("f,fni->ni", frame, polynomial_fields(at, FRAME_DEGREES))
        offset += sigma * random.standard_normal((n_stars, 2))
        columns = {"source_id": np.arange(n_stars), "orbit_id": orbit, "epoch": epoch}
        columns |= {"is_reference": False, "ra": ra, "dec": dec, "corr_conditional": 0.0}
        columns |= {f"sigma_{axis}_conditional": sigma for axis in ("ra", "dec")}
        columns |= {"offset_ra": offset[:, 0], "offset_dec": offset[:, 1]}
        parts.append(pd.DataFrame(columns))
    return pd.concat(parts, ignore_index=True)


def test_frames_are_what_the_stars_say_about_them():
    frames = 0.3 * np.random.default_rng(2).standard_normal((len(EPOCHS), N_FRAME))
    found = compare_frames(history(frames, 1e-6), np.arange(len(EPOCHS)), CENTRE)
    expected = found.by_frame @ frames.ravel()
    atol = 1e-4 * np.abs(expected).max()
    np.testing.assert_allclose(found.values, expected, rtol=1e-5, atol=atol)
    # Five motions of the whole frame cannot be told from those of the stars.
    assert len(found.values) == (2 * len(EPOCHS) - 5) * len(FRAME_DEGREES)


def test_frames_without_differences_are_noise():
    flat = np.zeros((len(EPOCHS), N_FRAME))
    found = compare_frames(history(flat, 0.5), np.arange(len(EPOCHS)), CENTRE)
    chi2, dof = float(found.values @ found.values), len(found.values)
    assert abs(chi2 - dof) < 4.0 * np.sqrt(2.0 * dof)


def test_reference_stars_and_rare_stars_say_nothing_about_frames():
    rows = history(np.zeros((len(EPOCHS), N_FRAME)), 0.5)
    rare = rows[rows["orbit_id"] < 3]
    found = compare_frames(rare, np.arange(len(EPOCHS)), CENTRE)
    assert (found.n_stars, len(found.values)) == (0, 0)
    references = compare_frames(rows.assign(is_reference=True), np.arange(len(EPOCHS)), CENTRE)
    assert references.n_stars == 0


def sky_orbits(field, seed=5, n_orbits=10, n_stars=200):
    """Return orbits whose statistics follow a field, errors of stars, and noise.

    The frame follows the shift of the field, and the slopes hardly see what is linear.
    """
    random = np.random.default_rng(seed)
    at = random.uniform(-0.5, 0.5, (n_stars, 2))
    fields, sigma = polynomial_fields(at, FIELD_DEGREES), 0.25
    linear = polynomial_fields(at, FIELD_DEGREES[:3]).reshape(6, -1).T
    basis, _ = np.linalg.qr(linear)
    seen = fields.reshape(N_FIELDS, -1)
    seen = (seen - 0.99 * seen @ basis @ basis.T).reshape(fields.shape)
    error = sigma * random.standard_normal((n_stars, 2))
    error += np.einsum("f,fsi->si", field, fields)
    orbits = []
    for number in range(n_orbits):
        response = np.zeros((6 + N_FRAME + N_FIELDS, n_stars, 2))
        response[6 : 6 + N_FRAME : len(FRAME_DEGREES)] = fields[:: len(FIELD_DEGREES)] / n_stars
        response[6 + N_FRAME :] = -seen / (sigma**2 + 0.3**2)
        total = np.zeros((len(response), len(response)))
        total[:6, :6] = np.eye(6)
        total[6 : 6 + N_FRAME, 6 : 6 + N_FRAME] = 1e-4 * np.eye(N_FRAME)
        # As in a fit, the slopes vary with all errors as minus their response to the field.
        slopes = response[-N_FIELDS:].reshape(N_FIELDS, -1)
        total[-N_FIELDS:, -N_FIELDS:] = -slopes @ fields.reshape(N_FIELDS, -1).T
        total[-N_FIELDS:, -N_FIELDS:] -= sigma**2 * slopes @ slopes.T
        noise = np.linalg.cholesky(total + 1e-12 * np.eye(len(total)))
        values = np.einsum("rsi,si->r", response, error)
        values += noise @ random.standard_normal(len(noise))
        by_field = np.einsum("rsi,fsi->rf", response, fields)
        by_star, ids = sigma * response, np.arange(n_stars)
        orbits.append(SkyOrbit(float(number), 6, values, by_field, total, by_star, ids))
    return orbits


@pytest.fixture(scope="module")
def frames():
    rows = history(np.zeros((len(EPOCHS), N_FRAME)), 0.5)
    return compare_frames(rows, np.arange(len(EPOCHS)), CENTRE)


def zonal_of(frames, field, seed=5):
    return zonal_test(sky_orbits(field, seed, len(EPOCHS)), frames, AREA)


@pytest.mark.parametrize("weights", [[1.0] * 6, [0.9, 0.8, 0.5, 0.3, 0.2, 0.1], [1.0, 0.1]])
def test_weighted_squares_have_the_chance_of_their_chi2(weights):
    weights = np.array(weights)
    found = WeightedSquares.of(weights)
    totals = np.random.default_rng(8).standard_normal((1_000_000, len(weights))) ** 2 @ weights
    for chance in (0.1, 1e-2, 1e-3):
        limit = found.total(float(chdtri(found.dof, chance)))
        assert found.chi2(limit) == pytest.approx(chdtri(found.dof, chance), rel=1e-12)
        # A thousand of a million are uncertain by 3 per cent.
        assert np.mean(totals > limit) == pytest.approx(chance, rel=0.15)


def test_catalogue_without_smooth_errors_is_within_chance(frames):
    found = [zonal_of(frames, np.zeros(N_FIELDS), seed) for seed in range(40)]
    chi2, dof = np.mean([one.chi2 for one in found]), found[0].dof
    assert abs(chi2 - dof) < 4.0 * np.sqrt(2.0 * dof / len(found))
    assert max(one.sigma for one in found) < 4.0


def test_smooth_errors_are_seen_and_mapped(frames):
    field = np.zeros(N_FIELDS)
    # Quadratic to the East, 0.75 mas at a distance of half a degree.
    field[FIELD_DEGREES.index((2, 0))] = 3.0
    found = zonal_of(frames, field)
    assert found.sigma > 5.0
    table = zonal_field(found, CENTRE)
    grid = np.stack(np.meshgrid(*2 * [np.linspace(-0.4, 0.4, 9)]), axis=-1).reshape(-1, 2)
    shown, true = (
        np.einsum("f,fsi->si", one, polynomial_fields(grid, FIELD_DEGREES))
        for one in (table["coefficient"].to_numpy(), field)
    )
    flat = polynomial_fields(grid, FIELD_DEGREES[:3]).reshape(6, -1).T
    shown, true = (
        one.ravel() - flat @ np.linalg.lstsq(flat, one.ravel(), rcond=None)[0]
        for one in (shown, true)
    )
    assert np.sum(shown * true) / np.sqrt(np.sum(shown**2) * np.sum(true**2)) > 0.9


@pytest.mark.full
def test_typical_field_is_seen_in_half_of_the_runs(frames):
    typical = zonal_of(frames, np.zeros(N_FIELDS)).typical_mas

    def share_seen(rms):
        found = [zonal_of(frames, random_field(seed, rms), seed) for seed in range(100)]
        # As rare as by chance in one of 2,500 runs.
        return np.mean([one.sigma > 3.54 for one in found])

    assert 0.35 < share_seen(typical) < 0.65
    assert share_seen(0.5 * typical) < 0.1
    assert share_seen(2.0 * typical) > 0.9


def random_field(seed, rms):
    """Return a random field of an expected rms and waves of 1.5 to 3 deg, as a polynomial."""
    random, n_waves = np.random.default_rng([7, seed]), 60
    grid = np.stack(np.meshgrid(*2 * [np.linspace(-0.5, 0.5, 15)]), axis=-1).reshape(-1, 2)
    monomials = np.array([grid[:, 0] ** i * grid[:, 1] ** j for i, j in FIELD_DEGREES]).T
    angle, length = (
        random.uniform(0.0, 2.0 * np.pi, (2, n_waves)),
        random.uniform(1.5, 3.0, (2, n_waves)),
    )
    wave = 2.0 * np.pi * np.stack([np.cos(angle), np.sin(angle)], axis=-1) / length[..., None]
    phase = random.uniform(0.0, 2.0 * np.pi, (2, n_waves, 1))
    waves = np.cos(np.einsum("ckd,gd->ckg", wave, grid) + phase)
    values = rms * np.sqrt(2.0 / n_waves) * waves.sum(axis=1)
    return np.concatenate([np.linalg.lstsq(monomials, one, rcond=None)[0] for one in values])


def calibrations(change, n_orbits=20, seed=3):
    """Return a group of four parameters in the orbits of six seasons, the second changed."""
    random = np.random.default_rng(seed)
    time = np.linspace(-1.0, 1.0, n_orbits)
    angle = np.where(np.arange(n_orbits) % 6 < 3, 58.0, 238.0)
    values = random.standard_normal((n_orbits, 4))
    values[:, 1] += change(time, angle)
    rows = [
        (orbit, 61_800.0 + 30.0 * orbit, angle[orbit], "distortion, degree 3", f"A{k}", v, "um")
        for orbit in range(n_orbits)
        for k, v in enumerate(values[orbit])
    ]
    names = ["orbit_id", "epoch", "position_angle", "group", "label", "value", "unit"]
    return pd.DataFrame(rows, columns=names)


def trends_of(table):
    (series,) = all_series(table)
    return {trend.test.subject: trend for trend in trend_tests(series)}


@pytest.mark.parametrize(
    ("kind", "change", "size"),
    [
        ("trend", lambda time, _: 5.0 * time, 10.0),
        ("jump", lambda time, _: 6.0 * (time > 0.2), 6.0),
        ("season", lambda _, angle: 5.0 * (angle < 100.0), 5.0),
    ],
)
def test_change_of_a_parameter_is_seen_and_named(kind, change, size):
    found = trends_of(calibrations(change))
    assert max(found, key=lambda one: found[one].test.sigma) == kind
    assert found[kind].test.sigma > 4.0
    assert found[kind].label == "A1"
    assert found[kind].change == pytest.approx(size, rel=0.25)


def test_place_of_a_jump_is_the_id_of_its_first_orbit():
    table = calibrations(lambda time, _: 8.0 * (time > 0.2))
    assert trends_of(table)["jump"].orbit == 12
    assert trends_of(table.assign(orbit_id=2 * table["orbit_id"] + 5))["jump"].orbit == 29
    assert trends_of(table)["trend"].orbit is None


def test_scatter_alone_is_no_trend():
    sigmas = [
        trend.test.sigma
        for seed in range(40)
        for trend in trends_of(calibrations(lambda *_: 0.0, seed=seed)).values()
    ]
    assert np.mean(np.array(sigmas) > 2.0) < 0.1
    assert max(sigmas) < 4.0


def test_few_orbits_and_constant_parameters_have_no_trend():
    assert not [*all_series(calibrations(lambda *_: 0.0, n_orbits=5))]
    table = calibrations(lambda *_: 0.0).assign(value=3.0)
    assert not trend_tests(next(all_series(table)))


def test_calibration_of_an_orbit_has_no_common_change_of_the_detectors(result):
    def changed(scale, turn, shift):
        table = result.calibration.copy()
        x, y = (table["group"] == f"detector_{axis}" for axis in "xy")
        places = table.loc[x, "value"].to_numpy() + 1j * table.loc[y, "value"].to_numpy()
        places = places * scale * np.exp(1j * turn) + shift
        table.loc[x, "value"], table.loc[y, "value"] = places.real, places.imag
        return orbit_calibration(table, 3, 61_800.0)

    before, after = changed(1.0, 0.0, 0.0), changed(1.001, 1e-4, 30.0 + 4.0j)
    assert set(before["group"]) >= {"focal length", "distortion, degree 2", "distortion, degree 5"}
    assert not before.duplicated(["group", "label"]).any()
    np.testing.assert_allclose(after["value"], before["value"], rtol=2e-3, atol=1e-3)


def test_position_angles_about_zero_have_their_mean_there(result):
    table = result.calibration.copy()
    of_angle = table["group"] == "position_angle"
    table.loc[of_angle, "value"] = np.resize([359.9, 0.1], of_angle.sum())
    angle = orbit_calibration(table, 3, 61_800.0)["position_angle"]
    assert np.cos(np.radians(angle)).min() > 0.999
