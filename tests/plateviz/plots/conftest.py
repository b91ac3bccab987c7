"""Every plot with an example table, its frames, and its drawn figures."""

import functools
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from plateviz import plots, tables
from plateviz.figures.bokeh_figure import BokehFigure
from plateviz.tables.calibration_trends import calibration_trends
from plateviz.tables.run_diagnosis import no_tests
from plateviz.verdict.solution_tests import solution_tests
from solver.simulate.settings import SurveySettings
from solver.simulate.true_calibration import true_calibration
from tests.plateviz.linear_stars import N_STARS, LinearStars
from tests.plateviz.run_tables import calibrations, zonal


@pytest.fixture(scope="module")
def linear_fit(fit_result):
    """A fit whose sources are those of a dense linear problem."""
    ids = fit_result.sources["source_id"].head(N_STARS)
    return replace(fit_result, sources=LinearStars().sources(ids))


@pytest.fixture(scope="module")
def orbit_drawings(fit_result, linear_fit, compared, make_fit_result, truth, instrument):
    """Return name -> (draw, table): the plot as a function of the table."""
    residuals = tables.residual_map(fit_result, instrument, detector_id=0)
    fields = tables.footprint_fields(fit_result, instrument)
    groups = tables.kurtosis_by_group(fit_result)
    detector = instrument.detectors[0]
    differences = tables.comparison(fit_result, make_fit_result(2)[0])
    return {
        "footprint": (
            lambda t, **o: plots.plot_footprint(t, fields.head(20 * len(t)), **o),
            tables.footprint_sources(fit_result),
        ),
        "residual_map": (lambda t, **o: plots.plot_residual_map(t, detector, **o), residuals),
        "residual_scatter": (plots.plot_residual_scatter, tables.residual_scatter(fit_result)),
        "deviation": (plots.plot_deviation, tables.deviation(fit_result, truth)),
        "uncertainty": (plots.plot_uncertainty, tables.uncertainty(fit_result, instrument)),
        "convergence": (plots.plot_convergence, tables.convergence(fit_result)),
        "distortion": (plots.plot_distortion, tables.distortion(fit_result, instrument)),
        "pulls": (plots.plot_pulls, tables.pull_histogram(fit_result)),
        "exposure_chi2": (plots.plot_exposure_chi2, tables.exposure_chi2(fit_result)),
        "orders": (plots.plot_orders, tables.order_comparison(compared)),
        "comparison": (plots.plot_comparison, differences),
        "comparison_histogram": (plots.plot_comparison_histogram, differences),
        "comparison_map": (plots.plot_comparison_map, differences),
        "eigenmode_spectrum": (
            plots.plot_eigenmode_spectrum,
            tables.eigenmode_spectrum(fit_result),
        ),
        "eigenmode_deciders": (
            plots.plot_eigenmode_deciders,
            tables.eigenmode_deciders(fit_result),
        ),
        "eigenmode_groups": (plots.plot_eigenmode_groups, tables.eigenmode_groups(fit_result)),
        "eigenmode_shifts": (plots.plot_eigenmode_shifts, tables.eigenmode_shifts(fit_result)),
        "solution_tests": (plots.plot_solution_tests, solution_tests(fit_result)),
        "prior_shares": (plots.plot_prior_shares, tables.prior_shares(fit_result)),
        "mean_residual_map": (
            lambda t, **o: plots.plot_mean_residual_map(t, instrument, **o),
            tables.mean_residuals(fit_result, instrument),
        ),
        "field_residuals": (
            lambda t, **o: plots.plot_field_residuals(t, detectors=instrument.detectors, **o),
            tables.field_residuals(fit_result, instrument),
        ),
        "binned_residuals": (
            plots.plot_binned_residuals,
            tables.binned_residuals(fit_result, instrument),
        ),
        "detector_shifts": (
            plots.plot_detector_shifts,
            tables.detector_shifts(fit_result, instrument),
        ),
        "residual_correlation": (
            plots.plot_residual_correlation,
            tables.residual_correlation(fit_result, instrument),
        ),
        "exposure_tracks": (plots.plot_exposure_tracks, tables.exposure_tracks(fit_result)),
        "distortion_comparison": (
            plots.plot_distortion_comparison,
            tables.distortion_comparison(fit_result, make_fit_result(2)[0], instrument),
        ),
        "distortion_truth": (
            plots.plot_distortion_truth,
            tables.distortion_truth(
                fit_result,
                true_calibration(SurveySettings(), instrument, fit_result.exposures),
                instrument,
            ),
        ),
        "reference_fields": (
            plots.plot_reference_fields,
            tables.reference_fields(fit_result, instrument),
        ),
        "reference_influence": (
            plots.plot_reference_influence,
            tables.reference_influence(linear_fit),
        ),
        "residual_tails": (
            lambda t, **o: plots.plot_residual_tails(t, groups.head(20 * len(t)), **o),
            tables.residual_tails(fit_result),
        ),
        "largest_residuals": (plots.plot_largest_residuals, tables.largest_residuals(fit_result)),
    }


@pytest.fixture(scope="module")
def errors_by_count():
    n = np.arange(31, 92, 4)
    expected = np.sqrt(0.66**2 / n + 0.055**2)
    return pd.DataFrame(
        {
            "n_orbits": n,
            "n_sources": 20,
            "error_mas": 1.05 * expected,
            "error_low_mas": 0.95 * expected,
            "error_high_mas": 1.15 * expected,
            "expected_mas": expected,
            "noise_mas": 0.66 / np.sqrt(n),
            "floor_mas": 0.055,
        }
    )


@pytest.fixture(scope="module")
def survey_drawings(survey, errors_by_count):
    """Return name -> (draw, table): the plot as a function of the table."""
    return {
        "sky_distribution": (
            functools.partial(
                plots.plot_sky_distribution, area=((-1.4, 0.7), (-0.6, 0.6)), target=(-0.3, 0.1)
            ),
            tables.sky_distribution(survey.catalogue, survey.truth),
        ),
        "prior_separation": (
            plots.plot_prior_separation,
            tables.prior_separation(survey.catalogue, survey.truth),
        ),
        "zonal_errors": (plots.plot_zonal_errors, zonal(30.0)),
        "orbit_counts": (plots.plot_orbit_counts, tables.orbit_counts(survey.motions)),
        "error_by_count": (plots.plot_error_by_count, errors_by_count),
        "reference_scatter": (
            plots.plot_reference_scatter,
            tables.reference_scatter(survey.motions),
        ),
        "motion_pulls": (plots.plot_motion_pulls, tables.motion_pulls(survey.motions)),
        "motion_differences": (
            plots.plot_motion_differences,
            tables.motion_differences(tables.shared_motions(survey.motions, survey.motions)),
        ),
        "calibration_trends": (
            plots.plot_calibration_trends,
            calibration_trends(replace(no_tests(), calibrations=calibrations(0.2))),
        ),
        "orbit_health": (plots.plot_orbit_health, tables.orbit_health(survey.orbits)),
        "sky_track": (plots.plot_sky_track, tables.sky_track(*survey.source("reference"))),
        "time_series": (plots.plot_time_series, tables.time_series(*survey.source("reference"))),
    }


@pytest.fixture(scope="module")
def drawings(orbit_drawings, survey_drawings):
    """Return name -> (draw, table) of all plots."""
    return {**orbit_drawings, **survey_drawings}


@pytest.fixture(scope="module")
def figures(drawings):
    """Return name -> frames of the plot, sorted by title; each is made once."""

    @functools.cache
    def made(name):
        draw, table = drawings[name]
        return sorted(draw(table), key=lambda frame: frame.title)

    return made


@pytest.fixture(scope="module")
def drawn_figures(drawings):
    """Return (name, theme) -> the plot as drawn by Bokeh; each is drawn once."""

    @functools.cache
    def drawn(name, theme):
        draw, table = drawings[name]
        return BokehFigure(draw(table), theme)

    return drawn
