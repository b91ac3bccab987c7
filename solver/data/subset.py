"""Subset: sources, exposures and detectors of an orbit, such as those left out or selected."""

import hashlib
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from dataclasses import dataclass, fields
from functools import cached_property
from typing import Any

import numpy as np
import pandas as pd

# Number of members of a kind that a short description names one by one.
_FEW = 4
Exposure = tuple[int, int]
"""field_id and plate_id."""


@dataclass(frozen=True)
class Subset:
    """Some sources, exposures and detectors; kinds are the fields.

    A measurement belongs to it if its source, its exposure or its detector does.

    Attributes
    ----------
    sources : `source_id` of each source
    exposures : (`field_id`, `plate_id`) of each exposure
    detectors : `detector_id` of each detector
    """

    sources: frozenset[int] = frozenset()
    exposures: frozenset[Exposure] = frozenset()
    detectors: frozenset[int] = frozenset()

    def __bool__(self) -> bool:
        """Whether there is anything in it."""
        return any(self.by_kind().values())

    def __or__(self, other: "Subset") -> "Subset":
        """Return what is in either."""
        return self._with(other, frozenset.union)

    def __sub__(self, other: "Subset") -> "Subset":
        """Return what is in this one only."""
        return self._with(other, frozenset.difference)

    def __and__(self, other: "Subset") -> "Subset":
        """Return what is in both."""
        return self._with(other, frozenset.intersection)

    def __le__(self, other: "Subset") -> bool:
        """Whether all of this one is in the other one."""
        return not self - other

    def by_kind(self) -> dict[str, frozenset[Any]]:
        """Return the ids of each kind."""
        return {kind: getattr(self, kind) for kind in KINDS}

    def of_kinds(self, kinds: Collection[str]) -> "Subset":
        """Return the members of some kinds."""
        return Subset(**{kind: self.by_kind()[kind] for kind in kinds})

    @property
    def kinds(self) -> list[str]:
        """The kinds of which there are members."""
        return [kind for kind, ids in self.by_kind().items() if ids]

    @cached_property
    def digests(self) -> dict[str, str]:
        """A digest of the ids of each kind, which is the same for the same ids."""
        return {kind: _digest(ids) for kind, ids in self.by_kind().items()}

    def holds(self, rows: pd.DataFrame) -> np.ndarray:
        """Return whether each row is of a source, exposure or detector of it, shape (n,).

        Parameters
        ----------
        rows : with `field_id` and `plate_id`, and `source_id` and `detector_id` if they are of them
        """
        found = np.zeros(len(rows), dtype=bool)
        for _, ids, keys in self.beside(rows):
            found |= keys.isin(list(ids))
        return found

    def beside(self, rows: pd.DataFrame) -> Iterator[tuple[str, frozenset[Any], pd.Index]]:
        """Yield each kind of which there are members, their ids, and the id of each row.

        Parameters
        ----------
        rows : as of `holds`
        """
        if self.sources and "source_id" in rows:
            yield "source", self.sources, pd.Index(rows["source_id"])
        if self.exposures:
            pairs = rows[["field_id", "plate_id"]]
            yield "exposure", self.exposures, pd.MultiIndex.from_frame(pairs)
        if self.detectors and "detector_id" in rows:
            yield "detector", self.detectors, pd.Index(rows["detector_id"])

    def names(self) -> list[str]:
        """Return the members as text, sorted."""
        return [name for names in self._names_by_kind().values() for name in names]

    def short_names(self) -> list[str]:
        """Return the names, but "132 sources" where there are more than a few of a kind."""
        short = []
        for kind, names in self._names_by_kind().items():
            short += names if len(names) <= _FEW else [f"{len(names):,} {kind}"]
        return short

    def to_dict(self) -> dict[str, list]:
        """Return the ids as plain values; `from_dict` reads them back."""
        return {
            "sources": sorted(self.sources),
            "exposures": [list(pair) for pair in sorted(self.exposures)],
            "detectors": sorted(self.detectors),
        }

    @staticmethod
    def from_dict(values: Mapping[str, Iterable]) -> "Subset":
        """Return the subset that `to_dict` wrote."""
        return Subset(
            frozenset(values["sources"]),
            frozenset((field, plate) for field, plate in values["exposures"]),
            frozenset(values["detectors"]),
        )

    def _with(
        self, other: "Subset", of: Callable[[frozenset[Any], frozenset[Any]], frozenset[Any]]
    ) -> "Subset":
        return Subset(**{kind: of(getattr(self, kind), getattr(other, kind)) for kind in KINDS})

    def _names_by_kind(self) -> dict[str, list[str]]:
        return {
            kind: [f"{kind.removesuffix('s')} {id_text(one)}" for one in sorted(ids)]
            for kind, ids in self.by_kind().items()
        }


KINDS = tuple(field.name for field in fields(Subset))
NOTHING = Subset()


def id_text(member: int | Exposure) -> str:
    """Return the id of a source, an exposure or a detector as text: "7", or "0/3"."""
    return "/".join(map(str, member)) if isinstance(member, tuple) else str(member)


def _digest(ids: Collection[Any]) -> str:
    numbers = np.array(sorted(ids), dtype=np.int64)
    return hashlib.blake2b(numbers.tobytes(), digest_size=8).hexdigest()
