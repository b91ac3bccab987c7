"""The README: its size, its links, its columns and its map."""

import re

import pytest

from solver.data.schema import CATALOGUE, ENVIRONMENT, MEASUREMENT
from tests.docs.pages import PAGES, README, REPOSITORY, headings_of, section_of
from tests.test_architecture import FOLDERS, LOOSE

TEXT = README.read_text("utf-8")
TABLES = {"measurement": MEASUREMENT, "environment": ENVIRONMENT, "reference": CATALOGUE}
MOST_LINES_OF_MAP = 15


def map_lines():
    (block,) = re.findall(r"^```\n(.*?)^```$", section_of(README, "Map of the code"), re.M | re.S)
    return block.splitlines()


def test_readme_is_short():
    assert 6_000 <= len(TEXT.encode()) <= 8_000


def test_links_of_the_readme_lead_to_files_and_headings():
    for link in re.findall(r"\]\((?!http)(.+?)\)", TEXT):
        path, _, anchor = link.partition("#")
        target = REPOSITORY / path if path else README
        assert target.is_file(), link
        anchors = (
            {heading.lower().replace(" ", "-") for heading in headings_of(target)}
            if anchor
            else {""}
        )
        assert anchor in anchors, link


def test_readme_links_to_every_page():
    linked = set(re.findall(r"assets/docs/(\w[\w-]*)\.md", TEXT))
    assert {page.stem for page in PAGES} - linked == {"index"}


@pytest.mark.parametrize("name", TABLES)
def test_readme_names_the_columns_that_are_needed(name):
    row = re.search(rf"^\| {name} \| (.+) \|$", TEXT, re.MULTILINE)[1]
    needed = {column.name for column in TABLES[name] if column.required}
    assert set(re.findall(r"`(\w+)`", row)) == needed


def test_map_names_every_folder_from_low_to_high():
    lines = map_lines()
    assert len(lines) <= MOST_LINES_OF_MAP
    found = {}
    for line in lines:
        package = re.match(r"(\w+)/", line)
        if package:
            names = found.setdefault(package[1], [])
        else:
            # Names stand together at the left; what follows wider space explains them.
            names += re.findall(r"[\w.]+", re.split(r" {3,}", line.strip())[0])
    loose = {name.rpartition(".")[2] for name in LOOSE} - {"fit"}
    wanted = {
        package: [name for name in names if name not in loose] for package, names in FOLDERS.items()
    }
    named = {package: [n.removesuffix(".py") for n in names] for package, names in found.items()}
    assert named == wanted
