import numpy as np
import pandas as pd
import pytest

from plateviz.plots.elements.arrows import Field, arrows, automatic_scale, key, round_125

FIELD = Field((-10.0, 10.0), (-10.0, 10.0))


@pytest.fixture
def vectors():
    random = np.random.default_rng(5)
    columns = dict(zip("xyuv", random.normal(size=(4, 40)), strict=True))
    return pd.DataFrame(columns).assign(u=lambda t: 1e-3 * t["u"], v=lambda t: 1e-3 * t["v"])


def _drawn(vectors, scale):
    strokes, tails = arrows(
        vectors, scale=scale, field=FIELD, colour="#000000", hover=[("u", "@{u}")]
    )
    strokes = _table(strokes)
    return strokes[: len(vectors)], strokes[len(vectors) :], _table(tails)


def _table(glyphs):
    return pd.DataFrame(dict(glyphs.columns))


def _lengths(segments):
    return np.hypot(segments["x1"] - segments["x0"], segments["y1"] - segments["y0"])


@pytest.mark.parametrize(
    ("value", "expected"),
    [(1.0, 1.0), (1.3, 1.0), (1.6, 2.0), (3.0, 2.0), (3.3, 5.0), (8.0, 10.0), (4.4e-3, 0.005)],
)
def test_round_125_takes_the_nearest_step(value, expected):
    assert round_125(value) == expected


@pytest.mark.parametrize("value", [0.0, -1.0, float("nan"), float("inf")])
def test_round_125_without_a_positive_value_is_one(value):
    assert round_125(value) == 1.0


def test_shafts_have_the_length_of_the_vectors_times_the_scale(vectors):
    shafts, _, _ = _drawn(vectors, 1000.0)
    assert np.allclose(_lengths(shafts), 1000.0 * np.hypot(vectors["u"], vectors["v"]))


def test_heads_start_at_the_tips(vectors):
    shafts, heads, _ = _drawn(vectors, 1000.0)
    assert len(heads) == 2 * len(shafts)
    assert np.allclose(heads["x0"].to_numpy()[::2], shafts["x1"])
    assert np.allclose(heads["y0"].to_numpy()[1::2], shafts["y1"])


def test_heads_are_smaller_than_their_arrow(vectors):
    shafts, heads, _ = _drawn(vectors, 1000.0)
    assert (_lengths(heads).to_numpy()[::2] < 0.5 * _lengths(shafts).to_numpy()).all()


def test_automatic_scale_is_round_and_shows_the_rms_arrow_at_4_percent(vectors):
    scale = automatic_scale(vectors, FIELD)
    rms = np.sqrt(np.mean(vectors["u"] ** 2 + vectors["v"] ** 2))
    assert scale == round_125(scale)
    assert 0.04 / np.sqrt(2.6) < scale * rms / 20.0 < 0.04 * np.sqrt(2.6)


def test_automatic_scale_follows_the_size_of_the_vectors(vectors):
    larger = vectors.assign(u=10 * vectors["u"], v=10 * vectors["v"])
    assert automatic_scale(larger, FIELD) == pytest.approx(automatic_scale(vectors, FIELD) / 10)


def test_automatic_scale_of_vectors_without_length_is_one(vectors):
    assert automatic_scale(vectors.assign(u=0.0, v=0.0), FIELD) == 1.0


@pytest.mark.parametrize("x", [(-10.0, 10.0), (10.0, -10.0)], ids=["upwards", "East to the left"])
def test_key_arrow_has_its_true_length_and_is_below_the_data(x):
    field = Field(x, FIELD.y)
    strokes, label = key(2e-3, "2 milli", scale=1000.0, field=field)
    segment = _table(strokes)
    assert _lengths(segment).iloc[0] == pytest.approx(2.0)
    assert field.ylim[0] < segment["y0"].iloc[0] < field.y[0]
    assert label.values("text").tolist() == ["2 milli"]


@pytest.mark.parametrize("x", [(-10.0, 10.0), (10.0, -10.0)], ids=["upwards", "East to the left"])
def test_area_is_enlarged_to_hold_the_heads_of_all_arrows(vectors, x):
    long = pd.DataFrame({"x": [9.0, 0.0], "y": [0.0, -9.5], "u": [4.0, 0.0], "v": [0.0, -2.0]})
    field = Field(x, FIELD.y).holding(long, 2.0)
    (strokes, _) = arrows(long, scale=2.0, field=field, colour="#000000", hover=[])
    ends = _table(strokes)
    for axis, limits in (("x", field.x), ("y", field.y)):
        drawn = ends[[f"{axis}0", f"{axis}1"]].to_numpy()
        assert min(limits) < drawn.min() < drawn.max() < max(limits)
    assert (field.x[0] > 0) == (x[0] > 0)


def test_area_that_holds_all_arrows_stays_as_it_is(vectors):
    assert FIELD.holding(vectors, 1.0) == FIELD
