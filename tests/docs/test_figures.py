"""Every figure of the gallery has its section, with an example of good and one of bad."""

import re
import sys

import pytest
from PIL import Image

from plateviz.plots.gallery import diagnostics, source_figures, survey_figures
from tests.docs.pages import DOCS, headings_of, section_of

ORBIT, SURVEY = DOCS / "diagnostics.md", DOCS / "survey-diagnostics.md"
EXAMPLES = DOCS / "figures"
PLACES = [
    *((figure, ORBIT) for figure in diagnostics()),
    *((figure, SURVEY) for figure in (*survey_figures(), *source_figures())),
]
MOST_BYTES, MOST_BYTES_IN_ALL = 60_000, 4_000_000

of_every_figure = pytest.mark.parametrize(
    ("figure", "page"), PLACES, ids=lambda value: getattr(value, "name", "")
)


@of_every_figure
def test_figure_has_a_section_with_both_examples(figure, page):
    assert figure.title in headings_of(page)
    shown = re.findall(r"!\[[^\]]+\]\(figures/(.+?)\)", section_of(page, figure.title))
    assert shown == [f"{figure.name}-good.png", f"{figure.name}-bad.png"]


@of_every_figure
def test_section_says_what_is_good_and_what_is_bad(figure, page):
    section = section_of(page, figure.title)
    in_a_table = "| good | bad |" in section
    in_prose = "**Good.**" in section and "**Bad.**" in section
    assert in_a_table or in_prose
    words = re.sub(r"!\[.*?\]\(.*?\)", "", section)
    assert len(words.split()) > 30


@of_every_figure
def test_figure_names_its_section_and_its_equation(figure, page):
    assert figure.document == f"assets/docs/{page.name}, “{figure.title}”"
    assert len(figure.equation) > 10


@pytest.mark.parametrize(
    ("page", "figures"),
    [(ORBIT, diagnostics()), (SURVEY, (*survey_figures(), *source_figures()))],
    ids=["orbit", "survey"],
)
def test_sections_are_in_the_order_of_the_page(page, figures):
    titles = [figure.title for figure in figures]
    assert [heading for heading in headings_of(page) if heading in titles] == titles


@pytest.mark.parametrize("kind", ["good", "bad"])
@of_every_figure
def test_example_is_small_and_not_blank(figure, page, kind):
    path = EXAMPLES / f"{figure.name}-{kind}.png"
    # An empty frame with a message has three thousand bytes.
    assert 5_000 < path.stat().st_size <= MOST_BYTES
    image = Image.open(path).convert("L")
    assert min(image.size) > 200
    assert max(image.size) <= 1400
    drawn = sum(image.histogram()[:200])
    assert 0.01 < drawn / (image.width * image.height) < 0.5


@of_every_figure
def test_good_and_bad_differ(figure, page):
    good, bad = (EXAMPLES / f"{figure.name}-{kind}.png" for kind in ("good", "bad"))
    assert good.read_bytes() != bad.read_bytes()


def test_folder_holds_only_these_examples():
    wanted = {f"{figure.name}-{kind}.png" for figure, _ in PLACES for kind in ("good", "bad")}
    found = list(EXAMPLES.iterdir())
    assert {path.name for path in found} == wanted
    assert sum(path.stat().st_size for path in found) < MOST_BYTES_IN_ALL


def test_script_has_a_case_for_every_figure(monkeypatch):
    monkeypatch.setattr(sys, "path", [str(DOCS), *sys.path])
    import figure_orbits
    import figure_surveys

    assert set(figure_orbits.ORBITS) == {figure.name for figure in diagnostics()}
    assert set(figure_surveys.SURVEYS) == {figure.name for figure in survey_figures()}
    assert set(figure_surveys.SOURCES) == {figure.name for figure in source_figures()}
