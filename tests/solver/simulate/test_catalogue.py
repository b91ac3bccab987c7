"""The true catalogue, its selection from Gaia, and the reference catalogue."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from solver.data.schema import CATALOGUE, TRUTH
from solver.errors import InputError
from solver.simulate.catalogue import (
    FIRST_ARTIFICIAL_ID,
    reference_catalogue,
    truth_catalogue,
    truth_from_gaia,
)
from solver.simulate.settings import SurveySettings
from solver.simulate.sky import icrs_to_galactic

SETTINGS = SurveySettings(n_stars=6000, n_reference=1500, n_artificial=200)
ASTROMETRY = ("ra", "dec", "pmra", "pmdec", "parallax")


@pytest.fixture(scope="module")
def truth() -> pd.DataFrame:
    return truth_catalogue(SETTINGS)


@pytest.fixture(scope="module")
def reference(truth: pd.DataFrame) -> pd.DataFrame:
    return reference_catalogue(truth, SETTINGS)


def by_the_papers_cuts(table: pd.DataFrame) -> np.ndarray:
    """Eq. (exp:error), in uas."""
    along = [
        (1e3 * table[f"{axis}_error"]) ** 2 + (13.0 * 1e3 * table[f"pm{axis}_error"]) ** 2
        for axis in ("ra", "dec")
    ]
    return (table["parallax_error"] < 25e-3) & (np.sqrt(sum(along)) < 500.0)


def test_counts_are_exact(truth: pd.DataFrame) -> None:
    assert truth["is_reference"].sum() == SETTINGS.n_reference
    assert truth["is_artificial"].sum() == SETTINGS.n_artificial
    assert len(truth) == SETTINGS.n_stars + SETTINGS.n_artificial
    assert list(truth.columns) == TRUTH.names


def test_reference_stars_are_those_that_satisfy_the_cuts(truth: pd.DataFrame) -> None:
    stars = truth[~truth["is_artificial"]]
    np.testing.assert_array_equal(by_the_papers_cuts(stars), stars["is_reference"])
    assert (stars["parallax"] > 5.0 * stars["parallax_error"]).all()


def test_stars_fill_the_extended_field_and_are_sparser_in_the_plane(truth: pd.DataFrame) -> None:
    stars = truth[~truth["is_artificial"]]
    l_deg, b_deg = icrs_to_galactic(stars["ra"].to_numpy(), stars["dec"].to_numpy())
    assert -1.95 <= l_deg.min() < -1.85
    assert 1.15 < l_deg.max() <= 1.25
    assert -1.15 <= b_deg.min() < -1.10
    assert 1.10 < b_deg.max() <= 1.15
    assert (np.abs(b_deg) < 0.3).mean() < 0.75 * 0.6 / 2.3


def test_artificial_sources_are_fixed_around_the_target(truth: pd.DataFrame) -> None:
    sources = truth[truth["is_artificial"]]
    assert (sources[["pmra", "pmdec", "parallax"]] == 0.0).all(axis=None)
    l_deg, b_deg = icrs_to_galactic(sources["ra"].to_numpy(), sources["dec"].to_numpy())
    assert np.abs(l_deg + 0.3).max() == pytest.approx(0.3, abs=0.02)
    assert np.abs(b_deg - 0.1).max() == pytest.approx(0.3, abs=0.02)


def test_ids_are_unique_and_too_long_for_float64(truth: pd.DataFrame) -> None:
    ids = truth["source_id"]
    assert ids.dtype == np.int64
    assert ids.is_unique
    assert ids.is_monotonic_increasing
    stars = ids[~truth["is_artificial"]].to_numpy()
    assert (stars.astype(np.float64).astype(np.int64) != stars).mean() > 0.9
    assert ((ids >= FIRST_ARTIFICIAL_ID) == truth["is_artificial"]).all()


def test_truth_depends_on_the_seed(truth: pd.DataFrame) -> None:
    pd.testing.assert_frame_equal(truth, truth_catalogue(replace(SETTINGS, orbits=3)))
    other = truth_catalogue(replace(SETTINGS, seed=1))
    assert not np.isin(other["ra"], truth["ra"]).any()


def test_impossible_cuts_are_refused() -> None:
    with pytest.raises(InputError, match="cuts that 10 reference stars satisfy"):
        truth_catalogue(
            SurveySettings(n_stars=20, n_reference=10, reference_parallax_error_mas=0.001)
        )


def test_reference_stars_scatter_by_their_own_errors(
    truth: pd.DataFrame, reference: pd.DataFrame
) -> None:
    assert list(reference.columns) == CATALOGUE.names
    chosen = truth["is_reference"]
    for name in ASTROMETRY:
        error = truth.loc[chosen, f"{name}_error"]
        pull = offset(name, truth, reference)[chosen] / error
        assert pull.std() == pytest.approx(1.0, abs=0.08)
        np.testing.assert_array_equal(reference.loc[chosen, f"{name}_error"], error)


def test_other_sources_scatter_by_the_vague_errors(
    truth: pd.DataFrame, reference: pd.DataFrame
) -> None:
    chosen = ~truth["is_reference"]
    for name, error in zip(ASTROMETRY, (1000.0, 1000.0, 1.0, 1.0, 1.0), strict=True):
        assert offset(name, truth, reference)[chosen].std() == pytest.approx(error, rel=0.05)
        assert (reference.loc[chosen, f"{name}_error"] == error).all()


def test_separations_at_the_observation_epoch_agree_with_the_paper(
    truth: pd.DataFrame, reference: pd.DataFrame
) -> None:
    offsets = {name: offset(name, truth, reference) for name in ASTROMETRY}
    separation = np.hypot(
        offsets["ra"] + 13.0 * offsets["pmra"], offsets["dec"] + 13.0 * offsets["pmdec"]
    )
    # Figure (exp:reference:hist): 200 to 500 uas, and typically 1.4 arcsec.
    assert 0.2 < separation[truth["is_reference"]].median() < 0.5
    rms = np.sqrt((separation[~truth["is_reference"]] ** 2).mean())
    assert rms == pytest.approx(1414.0, rel=0.05)


def offset(name: str, truth: pd.DataFrame, reference: pd.DataFrame) -> pd.Series:
    """Reference minus truth, mas or mas/yr, alpha* for ra."""
    factor = {"ra": 3.6e6 * np.cos(np.radians(truth["dec"])), "dec": 3.6e6}.get(name, 1.0)
    return (reference[name] - truth[name]) * factor


@pytest.fixture
def gaia(truth: pd.DataFrame) -> pd.DataFrame:
    stars = truth[~truth["is_artificial"]].drop(columns=["is_reference", "is_artificial"])
    return stars.assign(phot_g_mean_mag=15.0).sample(frac=1.0, random_state=1)


def test_gaia_selection_follows_the_paper(gaia: pd.DataFrame) -> None:
    gaia = gaia.reset_index(drop=True)
    gaia.loc[0, "parallax"] = 4.9 * gaia.loc[0, "parallax_error"]
    gaia.loc[1, "dec"] += 5.0
    gaia.loc[2, "pmra"] = np.nan
    selected = truth_from_gaia(gaia, SETTINGS)
    kept = gaia.iloc[3:].sort_values("source_id")
    stars = selected[~selected["is_artificial"]]
    np.testing.assert_array_equal(stars["source_id"], kept["source_id"])
    np.testing.assert_array_equal(stars["is_reference"], by_the_papers_cuts(kept))
    assert selected["is_artificial"].sum() == SETTINGS.n_artificial


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (
            lambda t: t.drop(columns=["pmra", "ref_epoch"]),
            "my.csv: .* found none for pmra, ref_epoch",
        ),
        (lambda t: t.assign(parallax="x"), "my.csv, column .parallax.: expected numbers"),
        (lambda t: t.assign(source_id=t["source_id"] * 1.0), "source_id.: expected integers"),
        (lambda t: t.assign(source_id=1), "expected each source_id once"),
        (lambda t: t.assign(source_id=t["source_id"] + 5 * 10**18), "ids below"),
        (lambda t: t.assign(parallax_error=1.0, parallax=10.0), "found none among 6000 rows"),
    ],
    ids=["missing", "text", "float-ids", "repeated", "reserved", "no-reference"],
)
def test_invalid_gaia_tables_are_refused(gaia: pd.DataFrame, change: object, message: str) -> None:
    with pytest.raises(InputError, match=message):
        truth_from_gaia(change(gaia), SETTINGS, "my.csv")
