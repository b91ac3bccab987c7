"""The built site: its links work, and it needs no network."""

from html.parser import HTMLParser
from urllib.parse import unquote, urldefrag, urlsplit

import pytest
from typer.main import get_command

import plateviz.plots
import plateviz.tables
import solver
from plateviz.cli.main import app
from solver.data.engine_settings import NutsSettings, SviSettings
from solver.data.parameters import PARAMETERS
from solver.data.schema import CATALOGUE, ENVIRONMENT, MEASUREMENT, RESULT_TABLES, TRUTH
from solver.data.settings import FitSettings
from solver.data.survey_schema import ERRORS_BY_COUNT, HISTORY, MOTIONS, RUN_ORBITS
from solver.io import published_layout as layout
from solver.simulate.settings import SurveySettings
from tests.docs.pages import DOCS, PAGES

pytestmark = pytest.mark.slow

COMMANDS = get_command(app).commands
# Elements that a browser loads with a page, and the attribute with their address.
_LOADED = {"script": "src", "img": "src", "link": "href", "iframe": "src", "source": "src"}


class _Page(HTMLParser):
    """Ids, links, loaded files and text of a page."""

    def __init__(self, text):
        super().__init__()
        self.ids, self.links, self.loaded, self.words, self.equations = set(), [], [], [], 0
        self.feed(text)

    def handle_starttag(self, tag, attrs):
        given = dict(attrs)
        self.ids |= {given["id"]} if given.get("id") else set()
        self.equations += tag == "svg" and "equation" in (given.get("class") or "")
        if tag == "a" and given.get("href"):
            self.links.append(given["href"])
        if given.get(_LOADED.get(tag, "")):
            self.loaded.append(given[_LOADED[tag]])

    def handle_data(self, data):
        self.words.append(data)

    @property
    def text(self):
        return " ".join("".join(self.words).split())


@pytest.fixture(scope="module")
def pages(site):
    return {path: _Page(path.read_text("utf-8")) for path in site.glob("*.html")}


@pytest.fixture(scope="module")
def page(pages, site):
    return lambda name: pages[site / f"{name}.html"]


def plain(words):
    """Return a text as it appears in a page, without backticks."""
    return " ".join(words.replace("`", "").split())


def test_every_page_is_built(pages):
    assert {path.stem for path in PAGES} <= {path.stem for path in pages}


def test_nothing_is_loaded_from_elsewhere(pages, site):
    for path, one in pages.items():
        for address in one.loaded:
            assert not urlsplit(address).netloc, f"{path.name}: {address}"
            if not address.startswith(("data:", "#")):
                assert (site / unquote(urlsplit(address).path)).is_file(), address


def test_links_within_the_site_lead_somewhere(pages):
    for path, one in pages.items():
        for link in one.links:
            if urlsplit(link).scheme:
                continue
            address, anchor = urldefrag(link)
            target = path.parent / unquote(address) if address else path
            assert target.is_file(), f"{path.name}: {link}"
            if anchor and target in pages:
                assert unquote(anchor) in pages[target].ids, f"{path.name}: {link}"


def test_no_style_sheet_asks_for_a_font_from_elsewhere(site):
    for sheet in site.rglob("*.css"):
        assert "url(http" not in sheet.read_text("utf-8").replace('"', "").replace("'", "")


@pytest.mark.parametrize("name", ["concepts", "uncertainties", "survey"])
def test_equations_are_drawn(page, name):
    dollars = (DOCS / f"{name}.md").read_text("utf-8").count("$")
    # A displayed equation has four dollar signs, an inline one two.
    assert dollars / 4 <= page(name).equations <= dollars / 2


@pytest.mark.parametrize(
    "table",
    [MEASUREMENT, ENVIRONMENT, CATALOGUE, TRUTH, HISTORY, MOTIONS, ERRORS_BY_COUNT, RUN_ORBITS],
    ids=lambda table: table.name,
)
def test_every_column_that_is_read_is_described(page, table):
    text = page("formats").text
    for column in table:
        assert f"{column.name} {column.dtype}" in text
        assert plain(column.meaning) in text
        assert all(alias in text for alias in column.aliases)


@pytest.mark.parametrize("table", RESULT_TABLES, ids=lambda table: table.name)
def test_every_column_of_a_result_is_described(page, table):
    text = page("formats").text
    kept = [one for one in vars(layout).values() if isinstance(one, layout.PublishedTable)]
    (found,) = (one for one in kept if one.table is table)
    assert found.hdu in text
    for column in table:
        assert found.name(column) in text
        assert plain(column.meaning) in text


@pytest.mark.parametrize(
    "kind", [FitSettings, SviSettings, NutsSettings, SurveySettings], ids=lambda kind: kind.__name__
)
def test_every_setting_is_described(page, kind):
    text = page("formats").text
    assert all(f" {name} " in text for name in kind.__dataclass_fields__)


def test_every_parameter_group_is_described(page):
    text = page("concepts").text
    assert all(f"{group.name} {group.symbol}" in text for group in PARAMETERS)


@pytest.mark.parametrize("name", COMMANDS)
def test_every_option_of_a_command_is_described(page, name):
    text = page("commands").text
    assert f"plateviz-{name}" in page("commands").ids
    section = text[text.index(f"plateviz {name} ", text.index("[OPTIONS]") - 200) :]
    for parameter in COMMANDS[name].params:
        if parameter.param_type_name == "option":
            assert all(option in section for option in parameter.opts + parameter.secondary_opts)
        assert plain(parameter.help or "") in section


def test_every_public_name_is_described(page):
    ids = page("api").ids
    described = {one.rpartition(".")[2] for one in ids}
    public = {*solver.__all__, *plateviz.plots.__all__, *plateviz.tables.__all__}
    # Constants, and the parameter table, which the page on concepts shows.
    constants = {name for name in public if name.isupper()}
    assert not public - constants - described
