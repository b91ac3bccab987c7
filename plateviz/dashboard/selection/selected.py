"""Selected: the sources, exposures and detectors that a person has selected, and their words."""

import hashlib
import re
import unicodedata
from collections.abc import Callable, Collection, Iterator, Mapping
from dataclasses import dataclass, fields
from functools import cached_property
from types import MappingProxyType
from typing import Any

import numpy as np
import pandas as pd

from plateviz.dashboard.address_parts import quoted
from plateviz.tables.labels import exposure_label
from solver.data.exclusions import Exclusions
from solver.data.ids import ID, is_id
from solver.errors import InputError

Exposure = tuple[int, int]
"""field_id and plate_id."""
SelectedIds = Mapping[str, frozenset[str]]
"""Column of a figure's marks -> its texts in the rows that are selected."""
NO_IDS: SelectedIds = MappingProxyType({})

# Maximum number of items of a kind in an address.
FEW = 20
MANY = "many:"
"""Stands, before their key, for more selected items of a kind than an address has room for."""
Find = Callable[[str, str], frozenset[Any] | None]
"""Returns the items of a kind with a key, as of `Selected.keys`; None if they are not known."""
# Runs of exposures and detectors that are named one by one.
_FEW_NAMED = 3
_LONGEST_NAME = 60
_NUMBERS = re.compile(rf"{ID}(,{ID})*")
_PAIRS = re.compile(rf"{ID}/{ID}(,{ID}/{ID})*")


@dataclass(frozen=True)
class Selected:
    """A selection; kinds are the fields.

    Attributes
    ----------
    sources : `source_id` of each selected source
    exposures : (`field_id`, `plate_id`) of each selected exposure
    detectors : `detector_id` of each selected detector
    """

    sources: frozenset[int] = frozenset()
    exposures: frozenset[Exposure] = frozenset()
    detectors: frozenset[int] = frozenset()

    def __bool__(self) -> bool:
        """Whether anything is selected."""
        return any(self.by_kind().values())

    def __or__(self, other: "Selected") -> "Selected":
        """Return what is in either selection."""
        return self._with(other, frozenset.union)

    def __sub__(self, other: "Selected") -> "Selected":
        """Return what is in this selection only."""
        return self._with(other, frozenset.difference)

    def __and__(self, other: "Selected") -> "Selected":
        """Return what is in both selections."""
        return self._with(other, frozenset.intersection)

    def __le__(self, other: "Selected") -> bool:
        """Whether all of this selection is in the other one."""
        return not self - other

    def by_kind(self) -> dict[str, frozenset[Any]]:
        """Return the selected items of each kind."""
        return {kind: getattr(self, kind) for kind in KINDS}

    def of_kinds(self, kinds: Collection[str]) -> "Selected":
        """Return the selected items of some kinds."""
        return Selected(**{kind: self.by_kind()[kind] for kind in kinds})

    @property
    def kinds(self) -> list[str]:
        """The kinds of which anything is selected."""
        return [kind for kind, items in self.by_kind().items() if items]

    @property
    def exclusions(self) -> Exclusions:
        """The selection as what a fit does not use."""
        return Exclusions(**self.by_kind())

    @staticmethod
    def of(exclusions: Exclusions) -> "Selected":
        """Return what a fit does not use as a selection."""
        return Selected(exclusions.sources, exclusions.exposures, exclusions.detectors)

    @cached_property
    def ids(self) -> SelectedIds:
        """Columns of figures, and the texts in them, that are selected; all figures share them."""
        texts = {
            "id": map(str, self.sources),
            "exposure": (exposure_label(*pair) for pair in self.exposures),
            "detector_id": map(str, self.detectors),
        }
        found = {column: frozenset(ids) for column, ids in texts.items()}
        return MappingProxyType({column: ids for column, ids in found.items() if ids})

    def chosen(self, rows: pd.DataFrame) -> np.ndarray:
        """Return whether each row is of a selected source, exposure or detector, shape (n,).

        Parameters
        ----------
        rows : with `field_id` and `plate_id`, and `source_id` and `detector_id` if they are of them
        """
        pairs = pd.MultiIndex.from_frame(rows[["field_id", "plate_id"]])
        found = pairs.isin(list(self.exposures)) if self.exposures else np.zeros(len(rows), bool)
        for column, ids in (("source_id", self.sources), ("detector_id", self.detectors)):
            if column in rows and ids:
                found = found | rows[column].isin(ids).to_numpy()
        return found

    @cached_property
    def keys(self) -> Mapping[str, str]:
        """Kinds of which more are selected than an address has room for, and keys of the items.

        The same items have the same key, in every session.
        """
        large = {kind: items for kind, items in self.by_kind().items() if len(items) > FEW}
        return MappingProxyType({kind: _key(items) for kind, items in large.items()})

    def address(self) -> dict[str, str]:
        """Return the selection as parts of an address, which `parsed` reads back.

        Of a kind of which more than a few are selected, it has only their key.
        """
        keys = self.keys
        return {
            kind: MANY + keys[kind] if kind in keys else ",".join(map(_text, sorted(items)))
            for kind, items in self.by_kind().items()
            if items
        }

    def words(self) -> str:
        """Return the selection in words, such as "132 sources, exposures 0/3 to 0/7"."""
        n = len(self.sources)
        texts = [f"{n:,} source{'s' * (n > 1)}"] if n else []
        if self.exposures:
            texts.append(_named("exposure", len(self.exposures), list(_runs(self.exposures))))
        if self.detectors:
            names = [str(number) for number in sorted(self.detectors)]
            texts.append(_named("detector", len(names), names))
        return ", ".join(texts)

    def _with(
        self, other: "Selected", of: Callable[[frozenset[Any], frozenset[Any]], frozenset[Any]]
    ) -> "Selected":
        return Selected(**{kind: of(getattr(self, kind), getattr(other, kind)) for kind in KINDS})


KINDS = tuple(field.name for field in fields(Selected))
NOTHING = Selected()


def parsed(address: Mapping[str, str], find: Find = lambda *_: None) -> tuple[Selected, list[str]]:
    """Return what an address selects, and the invalid parts in words; these select nothing.

    Parameters
    ----------
    find : looks for what is too large for an address, so that going back within a session finds it
    """
    found, problems = {}, []
    for kind, read in _READERS.items():
        text = address.get(kind)
        if text is None:
            continue
        if text.startswith(MANY):
            items = find(kind, text.removeprefix(MANY))
            problem = (
                f"{kind}: an address has room for {FEW}, and more were selected; "
                "Keep gives them a name for the address, and Save view has all"
            )
        else:
            items = read(text) if text.count(",") < FEW else None
            problem = f"{kind}: expected {FEW} ids or fewer, found {quoted(text)}"
        if items is None:
            problems.append(problem)
        else:
            found[kind] = items
    return Selected(**found), problems


def checked_name(text: str) -> str:
    """Return the name of a selection, without needless spaces.

    Raises
    ------
    InputError
        If it is empty or too long, or has characters that cannot be seen.
    """
    name = " ".join(text.split())
    if not 0 < len(name) <= _LONGEST_NAME:
        raise InputError(
            f"name of a selection: expected 1 to {_LONGEST_NAME} characters, found {len(name)}"
        )
    if any(unicodedata.category(character).startswith("C") for character in name):
        raise InputError("name of a selection: expected characters that can be seen")
    return name


def _key(items: Collection[Any]) -> str:
    numbers = np.array(sorted(items), dtype=np.int64)
    return hashlib.blake2b(numbers.tobytes(), digest_size=8).hexdigest()


def _text(item: int | Exposure) -> str:
    return "/".join(map(str, item)) if isinstance(item, tuple) else str(item)


def _numbers(text: str) -> frozenset[int] | None:
    if not _NUMBERS.fullmatch(text):
        return None
    ids = frozenset(map(int, text.split(",")))
    return ids if all(map(is_id, ids)) else None


def _pairs(text: str) -> frozenset[Exposure] | None:
    if not _PAIRS.fullmatch(text):
        return None
    pairs = (pair.split("/") for pair in text.split(","))
    ids = frozenset((int(field), int(plate)) for field, plate in pairs)
    return ids if all(is_id(field) and is_id(plate) for field, plate in ids) else None


_READERS: Mapping[str, Callable[[str], frozenset[Any] | None]] = MappingProxyType(
    {"sources": _numbers, "exposures": _pairs, "detectors": _numbers}
)


def _runs(exposures: Collection[Exposure]) -> Iterator[str]:
    """Return successive exposures of a field as "0/3 to 0/7"."""
    run: list[Exposure] = []
    for field, plate in sorted(exposures):
        if run and (field, plate) != (run[-1][0], run[-1][1] + 1):
            yield _run(run)
            run = []
        run.append((field, plate))
    yield _run(run)


def _run(run: list[Exposure]) -> str:
    first, last = ("/".join(map(str, exposure)) for exposure in (run[0], run[-1]))
    return first if len(run) == 1 else f"{first} to {last}"


def _named(kind: str, n: int, names: list[str]) -> str:
    if len(names) > _FEW_NAMED:
        return f"{n:,} {kind}s"
    return f"{kind}{'s' * (n > 1)} {', '.join(names)}"
