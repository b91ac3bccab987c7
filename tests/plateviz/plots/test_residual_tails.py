"""Contents of the figure of the tails of the residuals."""

import numpy as np
import pytest

from plateviz import tables
from plateviz.plots import plot_residual_tails
from plateviz.plots.diagnostic import Chosen
from plateviz.plots.gallery import diagnostics
from plateviz.verdict.verdict import orbit_verdict
from tests.plateviz.plots.drawn import subtitle_of


@pytest.fixture(scope="module")
def table(fit_result):
    return tables.residual_tails(fit_result)


@pytest.fixture(scope="module")
def groups(fit_result):
    return tables.kurtosis_by_group(fit_result)


def test_numbers_are_drawn_over_the_expected_ones(table, groups):
    frame, _ = plot_residual_tails(table, groups)
    assert frame.y.is_log
    assert frame.x.label == "threshold of |z| (σ)"
    for axis in "xy":
        rows = table[(table["axis"] == axis) & (table["found"] > 0)]
        assert np.array_equal(frame[axis].values("y"), rows["found"] / rows["expected"])
        assert np.allclose(frame[axis].values("x"), rows["threshold"], atol=0.05)
    one = table[table["axis"] == "x"]
    for end, name in (("y1", "low"), ("y2", "high")):
        drawn = frame["band"].values(end)
        assert np.array_equal(drawn, np.clip(one[name] / one["expected"], *frame.y.limits))
    width = frame["width"].values("y")
    assert width[0] == pytest.approx(one["of_width"].iloc[0] / one["expected"].iloc[0])


def test_thresholds_beyond_which_none_was_found_have_open_marks_at_the_bottom(table, groups):
    frame, _ = plot_residual_tails(table, groups)
    bottom, top = frame.y.limits
    for axis in "xy":
        rows = table[(table["axis"] == axis) & (table["found"] == 0)]
        none = frame[f"none in {axis}"]
        assert len(none) == len(rows) > 0
        assert none.looks["fill_alpha"] == 0.0
        assert frame[axis].looks["fill_alpha"] == 1.0
        assert (none.values("y") > bottom).all()
        assert (none.values("y") < 1.2 * bottom).all()
        # The hover says the number.
        assert (none.columns["found"] == 0).all()
        assert (frame[axis].values("y") > none.values("y").max()).all()
        assert (frame[axis].values("y") < top).all()


def test_marks_far_above_the_band_are_within_the_frame(table, groups):
    far = table.assign(found=20, ratio=20 / table["expected"])
    frame, _ = plot_residual_tails(far, groups)
    low, high = frame.y.limits
    assert low < far["ratio"].min() < far["ratio"].max() < high
    assert len(frame["none in x"]) == len(frame["none in y"]) == 0


def test_words_have_the_numbers_and_the_width(table, groups):
    given = table.assign(found=17, expected=12.5, ratio=17 / 12.5, scatter=3.5)
    frame, _ = plot_residual_tails(given, groups)
    words = subtitle_of(frame)
    assert f"of {table['n'].iloc[0]:,}: x 17, y 17, expected 12.5 ± 3.5 each" in words
    assert f"measured width {table['width'].iloc[0]:.3f}" in words


def test_kurtosis_of_each_exposure_is_drawn_with_its_band(table, groups):
    _, frame = plot_residual_tails(table, groups)
    rows = groups[groups["kind"] == "exposure"]
    assert np.array_equal(frame["exposures"].values("y"), rows["kurtosis"])
    assert frame["exposures"].columns["exposure"].tolist() == rows["exposure"].tolist()
    assert np.array_equal(frame["band"].values("y1")[::2], rows["low"])
    assert np.array_equal(frame["band"].values("y2")[1::2], rows["high"])
    low, high = frame.y.limits
    assert (
        low < rows[["low", "kurtosis"]].min().min() < rows[["high", "kurtosis"]].max().max() < high
    )


def test_disturbed_exposure_is_counted_and_named_by_its_size(table, groups):
    disturbed = groups.copy()
    rows = np.flatnonzero(disturbed["kind"] == "exposure")
    disturbed.loc[rows, "sigmas"] = 0.5
    disturbed.loc[rows[3], "sigmas"] = -7.25
    disturbed.loc[rows[4], "sigmas"] = 2.5
    disturbed.loc[disturbed["kind"] == "detector", "sigmas"] = [0.1, 1.5, -0.2, 0.0]
    _, frame = plot_residual_tails(table, disturbed)
    expected = f"{0.0455 * len(rows):.1f}"
    assert f"2 of {len(rows)} beyond ± 2σ, {expected} expected" in subtitle_of(frame)
    assert "largest −7.2σ, of detectors 1.5σ" in subtitle_of(frame)


def test_page_states_the_kurtosis_of_the_verdict(fit_result, instrument):
    (figure,) = (one for one in diagnostics() if one.name == "residual-tails")
    assert figure.needs_verdict
    _, frame = figure.plot(Chosen(fit_result, instrument))
    (test,) = (one for one in orbit_verdict(fit_result).tests if one.name == "kurtosis")
    value = f"{test.statistic:.2f}".replace("-", "−")
    words = f"all {value} ± {test.scatter:.2f} ({test.sigma:.1f}σ); x "
    assert subtitle_of(frame).startswith(words)


def test_exposures_of_few_measurements_give_a_message(table, groups):
    _, frame = plot_residual_tails(table, groups[groups["kind"] == "axis"])
    assert frame.title == "Excess kurtosis by exposure"
    assert "exposures" not in [one.name for one in frame.glyphs]
