from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from solver.data.result import FitStatus
from solver.data.settings import MAX_ORDER, FitSettings
from solver.data.subset import Subset
from solver.errors import CancelledError, FitError
from solver.fit import fit_orbit
from tests.solver.small_orbit import FIRST_ID, make_orbit

MAS = ["offset_ra", "offset_dec", "sigma_ra_marginal", "sigma_dec_marginal"]
# Far below the uncertainties of 1 mas, but above the tolerance of the last step (1e-3 of them).
SAME_MAS = 1e-4


def assert_same_sources(found, expected, columns=MAS):
    assert list(found["source_id"]) == list(expected["source_id"])
    np.testing.assert_allclose(found[columns], expected[columns], atol=SAME_MAS)


def coefficients(result):
    return result.values_on("coef").to_numpy()


def test_fit_converges_in_few_iterations(result):
    assert result.summary["converged"]
    assert result.summary["reason"] == FitStatus.CONVERGED.value
    assert result.summary["iterations"] <= 6


def test_fit_does_not_modify_its_input(small_orbit):
    before = {n: getattr(small_orbit.data, n).copy() for n in ("measurements", "exposures")}
    fit_orbit(small_orbit.data)
    for name, frame in before.items():
        pd.testing.assert_frame_equal(getattr(small_orbit.data, name), frame)


def test_gaia_ids_are_exact(result):
    assert result.sources["source_id"].min() >= FIRST_ID
    assert (result.sources["source_id"] % 2 == 0).any()
    assert (result.sources["source_id"] % 2 == 1).any()


def fitted(*orders):
    """Return fits of these orders to one orbit with fifth-order distortion."""
    orbit = make_orbit()
    return {
        order: fit_orbit(orbit.data, orbit.instrument, FitSettings(order=order)) for order in orders
    }


@pytest.fixture(scope="module")
def by_order():
    """Each order is another program to compile: the extremes, and those around the true one."""
    return fitted(0, 1, 4, 5, 6, MAX_ORDER)


@pytest.mark.full
@pytest.mark.slow
def test_every_order_converges():
    results = fitted(*range(MAX_ORDER + 1)).values()
    assert [r.summary["converged"] for r in results] == [True] * (MAX_ORDER + 1)
    assert [len(r.values_on("coef")) for r in results] == [0, 0, 3, 7, 12, 18, 25, 33, 42, 52]
    assert int(np.argmax([r.summary["log_evidence"] for r in results])) == 5


@pytest.mark.slow
def test_low_and_high_orders_converge(by_order):
    assert all(r.summary["converged"] for r in by_order.values())
    assert [len(r.values_on("coef")) for r in by_order.values()] == [0, 0, 12, 18, 25, 52]


@pytest.mark.slow
def test_evidence_is_highest_at_the_true_order(by_order):
    assert max(by_order, key=lambda order: by_order[order].summary["log_evidence"]) == 5


@pytest.mark.slow
def test_orders_0_and_1_give_the_same_solution(by_order):
    assert_same_sources(by_order[0].sources, by_order[1].sources)


@pytest.mark.slow
def test_higher_order_adds_terms_without_renaming_the_lower_ones(by_order):
    fits = by_order[5], by_order[6]
    lower, higher = (r.calibration[r.calibration["group"] == "distortion_x"] for r in fits)
    assert list(higher["label"])[: len(lower)] == list(lower["label"])


def test_row_order_does_not_change_the_solution(small_orbit, result, fit, with_tables):
    shuffled = with_tables(
        small_orbit,
        measurements=small_orbit.data.measurements.sample(frac=1.0, random_state=1),
        exposures=small_orbit.data.exposures.sample(frac=1.0, random_state=2),
        catalogue=small_orbit.data.catalogue.sample(frac=1.0, random_state=3),
        truth=small_orbit.data.truth.sample(frac=1.0, random_state=4),
    )
    found = fit(shuffled)
    assert_same_sources(found.sources, result.sources)
    key = ["field_id", "plate_id", "detector_id", "source_id"]
    ours, theirs = (r.residuals.sort_values(key)["model_x"].to_numpy() for r in (found, result))
    np.testing.assert_allclose(ours, theirs, atol=1e-5)
    measured = shuffled.data.measurements["source_id"].to_numpy()
    np.testing.assert_array_equal(found.residuals["source_id"], measured)
    np.testing.assert_array_equal(found.exposures["plate_id"], result.exposures["plate_id"])


def test_renumbered_exposures_only_reorder_the_rows(small_orbit, result, fit, with_tables):
    new = {0: 30, 1: 10, 2: 0, 3: 20}
    tables = {
        name: getattr(small_orbit.data, name).assign(
            plate_id=getattr(small_orbit.data, name)["plate_id"].map(new)
        )
        for name in ("measurements", "exposures")
    }
    found = fit(with_tables(small_orbit, **tables))
    assert_same_sources(found.sources, result.sources)
    order = [2, 1, 3, 0, 6, 5, 7, 4]
    np.testing.assert_allclose(
        found.values_on("exp", "offset"), result.values_on("exp", "offset").iloc[order], rtol=1e-4
    )


@pytest.mark.full
@pytest.mark.slow
def test_unmeasured_detector_does_not_change_the_solution(small_orbit, with_tables, fit):
    rows = small_orbit.data.measurements
    kept = with_tables(small_orbit, measurements=rows[rows["detector_id"] != 2])
    fewer = replace(
        kept.instrument, detectors=tuple(d for d in kept.instrument.detectors if d.detector_id != 2)
    )
    with_it, without = fit(kept), fit(kept._replace(instrument=fewer))
    assert_same_sources(with_it.sources, without.sources)
    unused = with_it.calibration[with_it.calibration["label"] == "detector 2"]
    np.testing.assert_allclose(unused["prior_share"], 1.0)
    np.testing.assert_allclose(unused["offset"], 0.0, atol=1e-9)


def test_unmeasured_exposure_does_not_change_the_solution(small_orbit, with_tables, fit):
    exposures = small_orbit.data.exposures.assign(obstime=61_822.0)
    rows = small_orbit.data.measurements
    is_removed = (rows["field_id"] == 1) & (rows["plate_id"] == 2)
    kept = with_tables(small_orbit, measurements=rows[~is_removed], exposures=exposures)
    dropped = with_tables(kept, exposures=exposures.drop(index=6))
    widths = {"position_angle": 3600.0}
    with_it, without = fit(kept, prior_widths=widths), fit(dropped, prior_widths=widths)
    assert_same_sources(with_it.sources, without.sources)
    assert list(with_it.exposures["n_obs"])[6] == 0


def test_field_across_zero_hours_has_the_same_solution(small_orbit, with_tables, fit):
    """Rotated about the pole, without the Earth's position and velocity, which are not rotated."""

    def turned(by):
        catalogue = small_orbit.data.catalogue.assign(parallax=0.0, parallax_error=0.0)
        catalogue["ra"] = (catalogue["ra"] + by) % 360.0
        exposures = small_orbit.data.exposures.copy()
        exposures["ra_est"] = (exposures["ra_est"] + by) % 360.0
        moved = with_tables(small_orbit, catalogue=catalogue, exposures=exposures, truth=None)
        return fit(moved, aberration=False)

    here, there = turned(0.0), turned(360.0 - small_orbit.data.exposures["ra_est"].mean())
    assert there.sources["ra"].min() < 1.0
    assert there.sources["ra"].max() > 359.0
    assert_same_sources(there.sources, here.sources)
    step = (there.sources["ra"] - here.sources["ra"]) % 360.0
    np.testing.assert_allclose(step, step.iloc[0], atol=1e-10)
    np.testing.assert_allclose(there.sources["dec"], here.sources["dec"], atol=1e-10)
    assert there.summary["chi2"] == pytest.approx(here.summary["chi2"], rel=1e-6)


def test_field_across_zero_hours_recovers_the_truth(fit):
    result = fit(make_orbit(ra=0.02))
    joined = result.sources.merge(result.true_places, on="source_id", suffixes=("", "_true"))
    turn = (joined["ra"] - joined["ra_true"] + 180.0) % 360.0 - 180.0
    pull = 3.6e6 * turn * np.cos(np.radians(joined["dec"])) / joined["sigma_ra_marginal"]
    assert joined["ra"].max() > 359.0
    assert pull.abs().max() < 5.0


def test_quadratic_distortion_absorbs_omitted_aberration(small_orbit, result, fit):
    """By some nm; in a small orbit the other orders are weakly constrained and change too."""
    without = fit(small_orbit, aberration=False)
    moved = np.abs(coefficients(without) - coefficients(result))
    assert 2e-3 < moved[:3].max() < 2e-2
    assert moved[3:].max() < 0.6 * moved[:3].max()
    assert without.summary["chi2"] == pytest.approx(result.summary["chi2"], rel=1e-3)


def test_mock_without_aberration_recovers_the_distortion(fit):
    orbit = make_orbit(aberration=False)
    result = fit(orbit, aberration=False)
    degrees = [(n - j, j) for n in range(2, 6) for j in range(n + 1)]
    truth = np.array([orbit.truth.distortion_x[d] for d in degrees])
    rows = result.calibration[result.calibration["group"] == "distortion_x"]
    assert np.abs((rows["value"] - truth) / rows["sigma_marginal"]).max() < 4.5


def test_satellite_velocity_improves_the_fit(with_tables, fit):
    """The effect is some 50 uas in a field, so the measurement noise here is 0.04 mas."""
    orbit = make_orbit(velocity=7.6, noise_pix=1e-4)
    still = orbit.data.exposures.assign(satellite_vx=0.0, satellite_vy=0.0, satellite_vz=0.0)
    used, left_out = fit(orbit), fit(with_tables(orbit, exposures=still))
    assert used.summary["chi2_per_dof"] == pytest.approx(1.0, abs=0.25)
    assert left_out.summary["chi2_per_dof"] > 1.2 * used.summary["chi2_per_dof"]


def test_better_measurements_give_better_positions(fit):
    fine, coarse = (fit(make_orbit(noise_pix=noise)).sources for noise in (0.001, 0.01))
    ratio = coarse["sigma_ra_conditional"] / fine["sigma_ra_conditional"]
    free = ~fine["is_reference"].to_numpy()
    np.testing.assert_allclose(ratio[free], 10.0, rtol=1e-3)


def test_conditional_sigma_is_sigma_over_root_n(small_orbit, result):
    """The paper's sigma/sqrt(N), for sources with a negligible prior."""
    free = result.sources[~result.sources["is_reference"]]
    scale = np.degrees(10.0 / 4.86e6) * 3.6e6
    rows = small_orbit.data.measurements
    variance = 0.5 * (rows["sx"] ** 2 + rows["sy"] ** 2)
    weight = (1.0 / variance).groupby(rows["source_id"]).sum()
    expected = scale / np.sqrt(weight[free["source_id"]].to_numpy())
    found = np.sqrt(free["sigma_ra_conditional"] * free["sigma_dec_conditional"])
    # Approximate, because sx and sy differ by up to 1.25/0.8 here.
    np.testing.assert_allclose(found, expected, rtol=0.08)
    assert np.median(found / expected) == pytest.approx(1.0, abs=0.02)


def test_iteration_limit_is_reported(small_orbit, fit):
    result = fit(small_orbit, max_iterations=1)
    assert result.summary["converged"] is False
    assert result.summary["reason"] == FitStatus.MAX_ITERATIONS.value
    assert result.summary["iterations"] == 1


def test_singular_orbit_raises(small_orbit, fit):
    names = ("focal_length", "pitch_x", "pitch_y", "detector_x", "detector_y")
    what = "orbit 7: .* leave a direction of the solution open.*narrow a prior that holds"
    with pytest.raises(FitError, match=what):
        fit(small_orbit, prior_widths=dict.fromkeys(names, np.inf))


def test_nan_measurements_raise(small_orbit, with_tables, fit):
    broken = small_orbit.data.measurements.assign(ny=np.nan)
    with pytest.raises(FitError, match="orbit 7: the residuals are not finite.*likely no number"):
        fit(with_tables(small_orbit, measurements=broken))


@pytest.mark.parametrize("factor", [1e-4, 1e-6])
def test_too_small_uncertainties_are_named(small_orbit, with_tables, fit, factor):
    """The priors vanish beside them."""
    table = small_orbit.data.measurements
    too_small = table.assign(sx=table["sx"] * factor, sy=table["sy"] * factor)
    with pytest.raises(FitError, match=r"uncertainties sx, sy of [\d.e-]+ pixel .*check the unit"):
        fit(with_tables(small_orbit, measurements=too_small))


def test_exception_in_progress_stops_the_fit(small_orbit):
    seen = []

    def stop(iteration):
        seen.append(iteration.iteration)
        if iteration.iteration == 1:
            raise CancelledError("enough")

    with pytest.raises(CancelledError, match="enough"):
        fit_orbit(small_orbit.data, small_orbit.instrument, progress=stop)
    assert seen == [0, 1]


def test_settings_and_provenance_are_kept(small_orbit):
    data = replace(small_orbit.data, provenance={"obs.fits": "abc"})
    result = fit_orbit(data, settings=FitSettings(prior_widths={"distortion_x": 2.0}))
    assert result.settings.width("distortion_x") == 2.0
    assert result.provenance == {"obs.fits": "abc"}
    assert result.orbit_id == 7


def test_tight_prior_constrains_its_parameters(small_orbit, fit):
    tight = fit(small_orbit, prior_widths={"distortion_x": 1e-6})
    assert np.abs(coefficients(tight)[:, 0]).max() < 1e-3
    assert np.abs(coefficients(tight)[:, 1]).max() > 0.3


@pytest.mark.parametrize("turn", [90.0, 180.0, -135.0])
def test_wrong_position_angle_is_solved(small_orbit, result, fit, with_tables, turn):
    exposures = small_orbit.data.exposures
    turned = with_tables(small_orbit, exposures=exposures.assign(pa_est=exposures["pa_est"] + turn))
    found = fit(turned)
    assert found.summary["converged"]
    for axis in ("ra", "dec"):
        moved = found.sources[f"offset_{axis}"] - result.sources[f"offset_{axis}"]
        assert (moved.abs() < 1e-3 * result.sources[f"sigma_{axis}_conditional"]).all()


def test_excluded_reference_stars_are_counted(small_orbit, fit):
    measured = small_orbit.data.measurements["source_id"]
    known = small_orbit.data.catalogue[small_orbit.data.catalogue["source_id"].isin(measured)]
    of_kind = [known.loc[known["is_reference"] == kind, "source_id"] for kind in (True, False)]
    chosen = frozenset([*of_kind[0].head(2).tolist(), *of_kind[1].head(3).tolist()])
    summary = fit(small_orbit, exclusions=Subset(sources=chosen)).summary
    assert summary["n_reference_excluded"] == 2
    assert summary["n_reference"] == len(of_kind[0]) - 2
