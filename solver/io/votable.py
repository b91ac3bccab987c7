"""Reading of VOTable documents, which may not make the reader download or expand anything."""

import math
import re
from pathlib import Path
from xml.parsers import expat

from astropy.io import votable
from astropy.table import Table

from solver.errors import InputError
from solver.io.failures import reading

_LARGEST_CELL = 10_000


def read_votable(path: Path) -> dict[str, Table]:
    """Read every table of a document, named after its name, ID or place."""
    with reading(str(path), "a VOTable"):
        _check_markup(path)
        document = votable.parse(path, verify="ignore")
        tables: dict[str, Table] = {}
        for index, element in enumerate(document.iter_tables()):
            name = element.name or element.ID or f"table{index}"
            if name in tables:
                raise InputError(f"{path}: expected each table name once, found {name} again")
            tables[name] = element.to_table(use_names_over_ids=True)
        return tables


def _check_markup(path: Path) -> None:
    # Entities can expand without limit, and an external stream would be downloaded.
    def refuse_entity(*_: object) -> None:
        raise InputError(f"{path}: expected a VOTable without entity declarations, found one")

    def check_element(tag: str, attributes: dict[str, str]) -> None:
        if re.fullmatch(r"(.*:)?(FIELD|PARAM)", tag):
            _check_cell(path, attributes.get("arraysize", ""))
        external = "href" in attributes or "gzip" in attributes.get("encoding", "")
        if re.fullmatch(r"(.*:)?STREAM", tag) and external:
            raise InputError(
                f"{path}: expected plain data inside the VOTable, "
                "found a STREAM that is compressed or points elsewhere"
            )

    parser = expat.ParserCreate()
    parser.EntityDeclHandler = refuse_entity
    parser.StartElementHandler = check_element
    with path.open("rb") as stream:
        parser.ParseFile(stream)


def _check_cell(path: Path, arraysize: str) -> None:
    """Refuse a column whose declared size alone would take much memory for each row."""
    sizes = [int(digits) for digits in re.findall(r"\d{1,18}", arraysize)]
    if math.prod(sizes) > _LARGEST_CELL:
        raise InputError(
            f"{path}: expected at most {_LARGEST_CELL} values in a cell, "
            f"found the arraysize {arraysize[:40]!r}"
        )
