"""`plateviz gaia`: the real astroquery against a small TAP service on this machine."""

import json
import sys
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from astropy.io import fits, votable
from astropy.table import Table
from astroquery.utils.tap import TapPlus

from plateviz.cli.gaia_archive import ARCHIVE, StarQuery, cached_file, star_query
from solver.errors import InputError
from solver.io.read_orbit import find_catalogue
from solver.io.survey import read_survey_orbit
from solver.model.correlation import CORRELATIONS
from solver.simulate.catalogue import truth_catalogue
from solver.simulate.gaia import GAIA, gaia_stars
from solver.simulate.settings import SurveySettings
from tests.plateviz.cli.tap_service import Service, archive_table, serving

SURVEY = SurveySettings(n_stars=600, n_reference=400, n_artificial=0, seed=3)
FORMATS = (".fits", ".ecsv", ".vot", ".parquet")


@pytest.fixture(scope="module")
def stars():
    truth = truth_catalogue(SURVEY).drop(columns=["is_reference", "is_artificial"])
    table = truth.assign(**dict.fromkeys(CORRELATIONS, 0.125))[GAIA.names]
    # The first hundred fail the parallax cut.
    table.loc[:99, "parallax_error"] = table.loc[:99, "parallax"] / 4.5
    return table


@pytest.fixture
def service(stars, monkeypatch, tmp_path):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    made = Service(stars)
    yield made
    made.database.close()


@pytest.fixture
def url(service):
    with serving(service) as address:
        yield address


def read(path):
    located = find_catalogue(path)
    return gaia_stars(located.table, located.where)


def test_survey_is_simulated_from_fetched_stars(run, url, stars, tmp_path):
    table, folder = tmp_path / "gaia.fits", tmp_path / "survey"
    assert run("gaia", table, "--url", url)[0] == 0
    code, _, err = run("simulate", folder, "--orbits", "1", "--catalog", table)
    assert (code, err.strip()) == (0, "")
    data = read_survey_orbit(folder, 0)
    true = data.truth.query("~is_artificial").merge(stars, on="source_id", suffixes=("", "_gaia"))
    np.testing.assert_array_equal(true["ra"], true["ra_gaia"])
    assert len(true) == (~data.truth["is_artificial"]).sum() > 5
    assert (data.catalogue.query("is_reference")[list(CORRELATIONS)] == 0.125).all(axis=None)


@pytest.mark.parametrize("suffix", FORMATS)
def test_every_format_has_the_stars_and_the_query(run, url, service, stars, tmp_path, suffix):
    path = tmp_path / f"gaia{suffix}"
    code, out, _ = run("gaia", path, "--url", url, "--json")
    printed = json.loads(out)
    assert code == 0
    assert printed["stars"] == len(stars) - 100
    assert (printed["output"], printed["service"], printed["from_cache"]) == (str(path), url, False)
    assert service.queries == [printed["query"]]
    assert [p.name for p in tmp_path.iterdir() if p.is_file()] == [path.name]
    found = read(path)
    np.testing.assert_array_equal(found["source_id"], stars["source_id"][100:])
    np.testing.assert_array_equal(found["pmra"], stars["pmra"][100:])
    np.testing.assert_allclose(found["ra_error"], stars["ra_error"][100:], rtol=1e-6)
    meta = metadata(path)
    assert {key: meta[key.upper()] for key in ("query", "service", "date")} == {
        key: printed[key] for key in ("query", "service", "date")
    }


def metadata(path):
    if path.suffix == ".fits":
        return fits.getheader(path, 1)
    if path.suffix == ".vot":
        infos = votable.parse(path).resources[0].infos
        return {info.name: info.value for info in infos}
    return find_catalogue(path).table.meta


def test_stars_without_a_magnitude_are_kept(run, url, stars, tmp_path):
    run("gaia", tmp_path / "gaia.fits", "--url", url)
    table = Table.read(tmp_path / "gaia.fits")
    magnitude = np.ma.filled(table["phot_g_mean_mag"], np.nan)
    assert table.colnames == ARCHIVE.names
    assert np.isnan(magnitude).sum() == (len(stars) - 100) // 50
    assert str(table["pmra"].unit) == "mas / yr"


def test_repeated_query_needs_no_network(run, service, tmp_path):
    with serving(service) as url:
        run("gaia", tmp_path / "first.parquet", "--url", url)
    code, out, _ = run("gaia", tmp_path / "second.parquet", "--url", url)
    assert code == 0
    assert "from the cache" in out
    first, second = (tmp_path / f"{name}.parquet" for name in ("first", "second"))
    assert first.read_bytes() == second.read_bytes()
    assert len(service.queries) == 1
    kept = cached_file(star_query(), url)
    assert kept.is_relative_to(tmp_path / "cache")
    assert metadata(kept)["QUERY"] == star_query().query


def test_refresh_queries_again(run, url, service, tmp_path):
    run("gaia", tmp_path / "gaia.ecsv", "--url", url)
    code, out, _ = run("gaia", tmp_path / "gaia.ecsv", "--url", url, "--refresh", "--overwrite")
    assert code == 0
    assert "fetched" in out
    assert len(service.queries) == 2


def test_queued_job_is_polled_until_it_ends(run, url, service, tmp_path):
    service.phases = ["QUEUED", "EXECUTING", "COMPLETED"]
    assert run("gaia", tmp_path / "gaia.ecsv", "--url", url)[0] == 0
    assert service.polls > 2


def test_different_selection_is_not_taken_from_the_cache(run, url, service, tmp_path):
    run("gaia", tmp_path / "gaia.ecsv", "--url", url)
    run("gaia", tmp_path / "other.ecsv", "--url", url, "--parallax-over-error", "10")
    assert len(service.queries) == 2


def test_damaged_cache_is_fetched_again(run, url, service, tmp_path):
    run("gaia", tmp_path / "gaia.ecsv", "--url", url)
    kept = cached_file(star_query(), url)
    kept.write_bytes(kept.read_bytes()[:1000])
    assert run("gaia", tmp_path / "again.ecsv", "--url", url)[0] == 0
    assert len(service.queries) == 2
    assert len(find_catalogue(kept).table) > 0


def test_archive_of_gaia_is_queried_by_default(run, url, service, monkeypatch, tmp_path):
    # On import, the archive's module requests notices over the network.
    monkeypatch.setitem(sys.modules, "astroquery.gaia", SimpleNamespace(Gaia=TapPlus(url=url)))
    code, out, _ = run("gaia", tmp_path / "gaia.ecsv", "--json")
    assert code == 0
    assert json.loads(out)["service"] == "the archive of Gaia"
    assert len(service.queries) == 1


@pytest.mark.parametrize(
    ("l_deg", "b_deg"),
    [
        ((-1.95, 1.25), (-1.15, 1.15)),
        ((-1.0, -0.5), (-0.2, 1.1)),
        ((0.1, 0.9), (0.0, 0.3)),
        ((359.0, 360.0), (-1.0, 1.0)),
        ((-180.0, 180.0), (0.2, 90.0)),
    ],
    ids=["through-zero", "below-zero", "above-zero", "to-zero", "half-sky"],
)
def test_query_selects_the_stars_of_the_field(service, stars, l_deg, b_deg):
    table = archive_table(stars)
    inside = table["b"].between(*b_deg) & (table["parallax_over_error"] > 5.0)
    inside &= (table["l"] - l_deg[0]) % 360.0 <= l_deg[1] - l_deg[0]
    names, rows = service.select(StarQuery(l_deg, b_deg, 5.0).query)
    assert names == ARCHIVE.names
    assert [row[0] for row in rows] == table["source_id"][inside].tolist()
    assert 0 < len(rows) < len(stars)


def test_default_selection_is_the_extended_field_of_the_survey():
    assert star_query() == StarQuery((-1.95, 1.25), (-1.15, 1.15), 5.0)


def cut_off(answer):
    info = b'<INFO name="QUERY_STATUS" value="OVERFLOW"/></RESOURCE>'
    return answer.replace(b"</RESOURCE>", info)


def without(*names):
    def edit(table):
        table.remove_columns(names)
        return table

    return edit


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"phases": ["ERROR"]}, "phase ERROR: Error 200: Cannot parse the query"),
        ({"phases": ["ABORTED"]}, "the job in phase ABORTED"),
        ({"finish": cut_off}, "expected a whole answer, found OVERFLOW after 500 rows"),
        ({"finish": lambda answer: answer[:20000]}, "expected an answer that is a VOTable"),
        ({"finish": lambda _: b"<html>sorry</html>"}, "expected an answer that is a VOTable"),
        ({"edit": without("ra_dec_corr")}, "found none for ra_dec_corr"),
        ({"edit": lambda table: table[:0]}, "expected from 1 to 2999999 stars, found 0 of SELECT"),
    ],
    ids=["error", "aborted", "overflow", "torn", "page", "column", "empty"],
)
def test_unusable_answers_give_one_message(run, url, service, tmp_path, change, message):
    for name, value in change.items():
        setattr(service, name, value)
    assert_refused(run, tmp_path, ["--url", url], message)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--url", "http://127.0.0.1:9/tap"], "expected an answer to the query, found Connection"),
        (["--url", "nowhere"], "nowhere: expected an answer to the query, found ValueError"),
        (["--l", "1", "-1"], "--l: expected limits from low to high, found 1.0 -1.0"),
        (["--l", "0", "361"], "--l: expected at most 360 deg, found 361"),
        (["--b", "80", "100"], "--b: expected latitudes from -90 to 90"),
    ],
    ids=["no-service", "no-address", "order", "turns", "pole"],
)
def test_invalid_options_give_one_message(run, service, tmp_path, options, message):
    assert_refused(run, tmp_path, options, message)


def test_missing_page_gives_one_message(run, url, tmp_path):
    wrong = url.replace("/tap", "/elsewhere")
    assert_refused(run, tmp_path, ["--url", wrong], "found HTTPError: Error 404: no such page")


def test_failed_refresh_changes_no_file(run, service, tmp_path):
    with serving(service) as url:
        run("gaia", tmp_path / "gaia.fits", "--url", url)
    kept, output = cached_file(star_query(), url), tmp_path / "gaia.fits"
    before = kept.read_bytes(), output.read_bytes()
    code, _, err = run("gaia", output, "--url", url, "--refresh", "--overwrite")
    assert code == 2
    assert "found ConnectionRefusedError" in err
    assert (kept.read_bytes(), output.read_bytes()) == before


def test_missing_astroquery_is_reported(run, service, monkeypatch, tmp_path):
    monkeypatch.setitem(sys.modules, "astroquery.gaia", None)
    assert_refused(run, tmp_path, [], "expected the package astroquery, which the extra 'gaia'")


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("gaia.txt", "expected a name that ends in .fits"),
        ("no/gaia.fits", "to write into a folder"),
    ],
    ids=["format", "folder"],
)
def test_unwritable_output_is_reported_before_the_query(run, url, service, tmp_path, name, message):
    code, _, err = run("gaia", tmp_path / name, "--url", url)
    assert code == 2
    assert message in err
    assert service.queries == []


def test_unwritable_cache_is_reported_before_the_query(run, url, service, tmp_path):
    (tmp_path / "cache").write_text("not a folder")
    code, _, err = run("gaia", tmp_path / "gaia.fits", "--url", url)
    assert code == 2
    assert "expected to create the folder" in err
    assert service.queries == []


def test_answer_at_the_row_limit_is_refused(run, url, tmp_path, monkeypatch):
    monkeypatch.setattr("plateviz.cli.gaia_archive.MOST_STARS", 300)
    assert_refused(run, tmp_path, ["--url", url], "expected from 1 to 299 stars, found 300")


def assert_refused(run, tmp_path, options, message):
    code, out, err = run("gaia", tmp_path / "gaia.fits", *options)
    assert code == 2
    assert message in err
    assert (out.strip(), len(err.strip().splitlines())) == ("", 1)
    assert not [path for path in tmp_path.rglob("*") if path.is_file()]


def test_limits_not_given_have_defaults():
    assert star_query(b_deg=(0.0, 1.0)) == replace(star_query(), b_deg=(0.0, 1.0))


def test_nan_limits_are_refused():
    with pytest.raises(InputError, match="--l: expected limits"):
        StarQuery((float("nan"), 1.0), (0.0, 1.0), 5.0)
