"""Exclusions: sources, exposures and detectors whose measurements a fit does not use."""

import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace

import numpy as np
import pandas as pd

from solver.data.ids import ID, is_id
from solver.data.orbit import OrbitData
from solver.errors import InputError

_EXCLUSION = re.compile(rf"(source|detector)=({ID})|(exposure)=({ID})/({ID})")
# Columns that identify an exposure.
_EXPOSURE = ["field_id", "plate_id"]
# Number of excluded items of a kind that a short description names one by one.
_FEW = 4


@dataclass(frozen=True)
class Exclusions:
    """Excluded sources, exposures and detectors.

    Attributes
    ----------
    sources : `source_id` of each excluded source
    exposures : (`field_id`, `plate_id`) of each excluded exposure
    detectors : `detector_id` of each excluded detector
    """

    sources: frozenset[int] = frozenset()
    exposures: frozenset[tuple[int, int]] = frozenset()
    detectors: frozenset[int] = frozenset()

    def __bool__(self) -> bool:
        """Whether anything is excluded."""
        return bool(self.sources or self.exposures or self.detectors)

    def __or__(self, other: "Exclusions") -> "Exclusions":
        """Return what either excludes."""
        return Exclusions(
            self.sources | other.sources,
            self.exposures | other.exposures,
            self.detectors | other.detectors,
        )

    def without(self, data: OrbitData) -> OrbitData:
        """Return the orbit without the excluded measurements; row labels stay those of `data`.

        Raises
        ------
        InputError
            If an excluded item has no measurements, or no measurement would remain.
        """
        if not self:
            return data
        rows = data.measurements
        for kind, excluded, keys in self._of_rows(rows):
            missing = excluded.difference(keys[keys.isin(list(excluded))].tolist())
            if missing:
                raise InputError(
                    f"excluded {kind} {_text(min(missing))}: expected one with measurements in "
                    f"orbit {data.orbit_id}, found none"
                )
        is_excluded = self.excludes(rows)
        if is_excluded.all():
            raise InputError(
                f"exclusions: expected some measurements of orbit {data.orbit_id} to remain, "
                f"found that all {len(rows)} are excluded"
            )
        return of_rows(data, ~is_excluded)

    def excludes(self, rows: pd.DataFrame) -> np.ndarray:
        """Return which rows of a table of measurements are excluded."""
        is_excluded = np.zeros(len(rows), dtype=bool)
        for _, excluded, keys in self._of_rows(rows):
            is_excluded |= keys.isin(list(excluded))
        return is_excluded

    def _of_rows(self, rows: pd.DataFrame) -> Iterator[tuple[str, frozenset, pd.Index]]:
        """Yield each kind that something is excluded of, what it is, and that of each row."""
        if self.sources:
            yield "source", self.sources, pd.Index(rows["source_id"])
        if self.exposures:
            yield "exposure", self.exposures, pd.MultiIndex.from_frame(rows[_EXPOSURE])
        if self.detectors:
            yield "detector", self.detectors, pd.Index(rows["detector_id"])

    def names(self) -> list[str]:
        """Return the excluded items as text, sorted."""
        return [name for names in self._names_by_kind().values() for name in names]

    def short_names(self) -> list[str]:
        """Return the names, but "132 sources" where there are more than a few of a kind."""
        short = []
        for kind, names in self._names_by_kind().items():
            short += names if len(names) <= _FEW else [f"{len(names):,} {kind}"]
        return short

    def _names_by_kind(self) -> dict[str, list[str]]:
        return {
            "sources": [f"source {number}" for number in sorted(self.sources)],
            "exposures": [f"exposure {_text(pair)}" for pair in sorted(self.exposures)],
            "detectors": [f"detector {number}" for number in sorted(self.detectors)],
        }

    def to_dict(self) -> dict[str, list]:
        """Return the exclusions as plain values; `from_dict` reads them back."""
        return {
            "sources": sorted(self.sources),
            "exposures": [list(pair) for pair in sorted(self.exposures)],
            "detectors": sorted(self.detectors),
        }

    @staticmethod
    def from_dict(values: Mapping[str, Iterable]) -> "Exclusions":
        """Return the exclusions that `to_dict` wrote."""
        return Exclusions(
            frozenset(values["sources"]),
            frozenset((field, plate) for field, plate in values["exposures"]),
            frozenset(values["detectors"]),
        )


def thinned_orbit(data: OrbitData, whole: OrbitData, every: int) -> OrbitData:
    """Return the orbit with every n-th reference source and every n-th other source.

    Parameters
    ----------
    data : the orbit after exclusions
    whole : the orbit before exclusions; the sources are chosen from it, so that the choice
        does not depend on the exclusions
    every : n
    """
    if every == 1:
        return data
    measured = np.unique(whole.measurements["source_id"].to_numpy())
    reference = whole.catalogue.set_index("source_id").loc[measured, "is_reference"].to_numpy(bool)
    kept = np.concatenate([measured[reference][::every], measured[~reference][::every]])
    return of_rows(data, data.measurements["source_id"].isin(kept).to_numpy())


def of_rows(data: OrbitData, chosen: np.ndarray) -> OrbitData:
    """Return the orbit with the chosen measurements and their exposures.

    Parameters
    ----------
    chosen : boolean, one per measurement
    """
    rows = data.measurements[chosen]
    measured = pd.MultiIndex.from_frame(rows[_EXPOSURE].drop_duplicates())
    used = pd.MultiIndex.from_frame(data.exposures[_EXPOSURE]).isin(measured)
    exposures = data.exposures[used].reset_index(drop=True)
    return replace(data, measurements=rows, exposures=exposures)


def parse_exclusions(texts: Iterable[str]) -> Exclusions:
    """Parse exclusions.

    Parameters
    ----------
    texts : each "source=ID", "detector=ID" or "exposure=FIELD/PLATE"

    Raises
    ------
    InputError
        If a text has another form.
    """
    sources, exposures, detectors = set(), set(), set()
    for text in texts:
        match = _EXCLUSION.fullmatch(text.strip())
        if match is None:
            raise InputError(
                "what to leave out: expected source=ID, exposure=FIELD/PLATE or detector=ID, such "
                f"as source=12 or exposure=0/3, found {text!r}"
            )
        if not all(is_id(int(number)) for number in match.group(2, 4, 5) if number):
            raise InputError(f"what to leave out: expected an id of 64 bits, found {text!r}")
        if match[3]:
            exposures.add((int(match[4]), int(match[5])))
        else:
            (sources if match[1] == "source" else detectors).add(int(match[2]))
    return Exclusions(frozenset(sources), frozenset(exposures), frozenset(detectors))


def _text(excluded: int | tuple[int, int]) -> str:
    return "/".join(map(str, excluded)) if isinstance(excluded, tuple) else str(excluded)
