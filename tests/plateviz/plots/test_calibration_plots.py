"""Contents of the tracks of the exposures and of the difference of two calibrations."""

from dataclasses import replace

import numpy as np
import pytest

from plateviz import tables
from plateviz.plots import plot_distortion_comparison, plot_exposure_tracks
from plateviz.plots.diagnostic import Chosen
from plateviz.plots.gallery import diagnostics
from solver.data.parameters import groups_on
from solver.simulate.settings import SurveySettings
from tests.plateviz.plots.drawn import shafts_of, subtitle_of, texts_of


@pytest.fixture(scope="module")
def tracked(fit_result):
    """A fit whose exposures are off their prior centres."""
    calibration = fit_result.calibration.copy()
    rows = calibration["group"].isin([group.name for group in groups_on("exp")])
    noise = np.random.default_rng(1).normal(2.0, 1.0, int(rows.sum()))
    calibration.loc[rows, "offset"] = noise
    return replace(fit_result, calibration=calibration)


@pytest.fixture(scope="module")
def differences(fit_result, make_fit_result, instrument):
    return tables.distortion_comparison(fit_result, make_fit_result(2)[0], instrument)


def test_tracks_have_a_panel_per_group(tracked):
    figure = plot_exposure_tracks(tables.exposure_tracks(tracked))
    titles = [frame.title.lower() for frame in figure]
    assert titles == [group.label.lower() for group in groups_on("exp")]
    assert {frame.x.limits for frame in figure} == {figure[0].x.limits}
    assert [frame.y.label[-5:] for frame in figure] == ["(mas)", "(mas)", "(mas)", " (µm)"]


def test_tracks_have_the_offsets_with_conditional_bars(tracked):
    table = tables.exposure_tracks(tracked)
    frame = plot_exposure_tracks(table)[0]
    rows = table[table["group"] == "pointing RA"]
    assert np.array_equal(frame["exposures"].values("y"), rows["offset"])
    bars = frame["error bars along y"]
    assert np.allclose(bars.values("y1") - bars.values("y0"), 2.0 * rows["sigma_conditional"])
    assert frame.y.limits[0] < bars.values("y0").min()
    assert frame.y.limits[1] > bars.values("y1").max()


def test_line_of_a_track_ends_with_each_field(tracked):
    table = tables.exposure_tracks(tracked)
    frame = plot_exposure_tracks(table)[0]
    gaps = np.flatnonzero(np.isnan(frame["steps"].values("x")))
    assert len(gaps) == table["field_id"].nunique()
    assert len(frame["steps"]) == len(frame["exposures"]) + len(gaps)


@pytest.mark.parametrize(
    ("width", "is_drawn"), [(0.5, True), (1e4, False), (np.inf, False)], ids=["narrow", "wide", ""]
)
def test_prior_is_a_strip_where_it_has_an_edge_in_the_frame(tracked, width, is_drawn):
    table = tables.exposure_tracks(tracked)
    scale = table["offset"].abs().max()
    frame = plot_exposure_tracks(table.assign(prior_sigma=width * scale))[0]
    assert ("prior" in frame.names) == is_drawn
    text = subtitle_of(frame)
    assert ("prior flat" in text) == (not np.isfinite(width))
    if is_drawn:
        assert frame["prior"].values("y1").item() == width * scale


def test_tracks_without_times_are_in_order(tracked):
    exposures = tracked.exposures.assign(obstime=np.nan)
    figure = plot_exposure_tracks(tables.exposure_tracks(replace(tracked, exposures=exposures)))
    assert figure[0].x.label == "exposure, in order"
    assert figure[0]["exposures"].values("x").tolist() == list(range(1, len(exposures) + 1))


def test_tracks_state_both_sigmas(tracked):
    frame = plot_exposure_tracks(tables.exposure_tracks(tracked))[3]
    assert "σ conditional 0.0100 µm, marginal 0.0200 µm" in subtitle_of(frame)


def test_differences_are_drawn_to_the_stated_scale(differences, instrument):
    figure = plot_distortion_comparison(differences, detectors=instrument.detectors)
    assert [len(frame["outlines"]) for frame in figure] == [len(instrument.detectors)] * 2
    for frame, (_, rows) in zip(figure, differences.groupby("part", sort=False), strict=True):
        shafts = shafts_of(frame)
        drawn = np.hypot(shafts["x1"] - shafts["x0"], shafts["y1"] - shafts["y0"])
        ratio = drawn / np.hypot(rows["u"].to_numpy(), rows["v"].to_numpy())
        scale = float(ratio.iloc[0])
        assert np.allclose(ratio, scale)
        assert f"enlarged {scale:,.9g} times" in subtitle_of(frame)
        assert "removed: " in subtitle_of(frame)
        (text,) = texts_of(frame)
        assert text.split(" = ")[0].endswith("µm")


def test_key_of_the_differences_is_as_long_as_it_says(differences, fit_result):
    frame = plot_distortion_comparison(differences)[0]
    (text,) = texts_of(frame)
    length_um = float(text.split()[0])
    key = frame["key"]
    drawn = key.values("x1")[0] - key.values("x0")[0]
    rows = differences[differences["part"] == differences["part"].iloc[0]]
    shafts = shafts_of(frame)
    scale = (shafts["x1"] - shafts["x0"]).iloc[0] / rows["u"].iloc[0]
    assert drawn == pytest.approx(scale * length_um / 1000.0)


@pytest.fixture
def diagnostic():
    (found,) = [one for one in diagnostics() if one.name == "distortion-comparison"]
    return found


def test_difference_needs_another_solution(diagnostic, fit_result, instrument):
    alone = Chosen(fit_result, instrument)
    assert not diagnostic.has_data(alone)
    assert diagnostic.plot(alone).message.startswith("How the distortion differs")


def test_difference_is_the_current_solution_minus_the_other(
    diagnostic, fit_result, make_fit_result, instrument
):
    other = make_fit_result(2)[0]
    figure = diagnostic.plot(Chosen(other, instrument, other=fit_result))
    table = tables.distortion_comparison(fit_result, other, instrument)
    drawn = figure[0]["tails"].columns["dx_um"]
    assert np.array_equal(drawn, table["dx_um"][: len(drawn)])


def test_distortion_minus_truth_says_which_truth_it_means(fit_result, instrument):
    (truth,) = [one for one in diagnostics() if one.name == "distortion-truth"]
    alone = Chosen(fit_result, instrument)
    assert not truth.has_data(alone)
    assert truth.plot(alone).message.startswith("No truth")
    settings = SurveySettings(defects=("distortion-drift=0.1um", "pixel-phase=3mpix"))
    chosen = Chosen(fit_result, instrument, simulation=settings)
    assert truth.has_data(chosen)
    figure = truth.plot(chosen)
    assert len(figure) == 2
    for frame in figure:
        said = subtitle_of(frame)
        assert "σ of a source: " in said
        assert "mean over the exposures of: distortion that drifts" in said
        assert "Not in the truth: shift that depends on the position within the pixel" in said
    plain = truth.plot(Chosen(fit_result, instrument, simulation=SurveySettings()))
    assert "ruth" not in subtitle_of(plain[0])
