"""Kept selections: sources, exposures and detectors that people have kept under a name, for all.

    {"format": "plateviz selections", "version": 1,
     "selections": {"NAME": {"sources": [...], "exposures": [[0, 3], ...], "detectors": [...]}}}

The file is beside the kept solutions (`plateviz.runs.kept_solutions`). Names are a person's text.
"""

import json
import threading
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from solver.data.subset import KINDS, Subset
from solver.errors import InputError
from solver.io.atomic import write_atomically
from solver.io.disk import writing
from solver.io.failures import reading
from solver.io.lock import locked

FILE = "selections.json"
MOST, MOST_ITEMS = 50, 30_000
"""Selections in a file, and items of all of them."""
_FORMAT, _VERSION = "plateviz selections", 1
_MOST_BYTES = 2_000_000


class TakenError(InputError):
    """Somebody else has kept another selection under the name."""


class KeptSelections:
    """The kept selections of one survey, or of the files of one orbit."""

    def __init__(self, folder: Path) -> None:
        """Look in a folder, which need not exist."""
        self._path = Path(folder) / FILE
        self._lock = threading.Lock()
        self._read: tuple[object, dict[str, Subset]] = (None, {})

    def all(self) -> dict[str, Subset]:
        """Return name -> selection, by name.

        Raises
        ------
        InputError
            If the file is damaged, or a newer version has written it.
        """
        with self._lock:
            return dict(self._all())

    def keep(self, name: str, selected: Subset, before: Subset | None) -> None:
        """Keep a selection under a name.

        Parameters
        ----------
        before : what is known to be kept under that name; None for nothing

        Raises
        ------
        DiskError
            If the disk is full or takes no file for another reason.
        TakenError
            If somebody else has kept another selection under that name.
        InputError
            If too much is kept, or as from `all`.
        """
        with writing(self._path.parent, "to keep the selection"):
            self._path.parent.mkdir(parents=True, exist_ok=True)
        with self._lock, locked(self._path.parent, wait=True):
            found = dict(self._all())
            if found.get(name) not in (None, before, selected):
                raise TakenError(
                    "somebody else has kept another selection under this name; choose another name"
                )
            found[name] = selected
            if len(found) > MOST or sum(map(_size, found.values())) > MOST_ITEMS:
                raise InputError(
                    f"{MOST} selections of {MOST_ITEMS:,} items in all are kept; forget one first"
                )
            self._write(found)

    def forget(self, name: str, before: Subset) -> None:
        """Keep nothing under a name any more, unless it is another selection than before.

        Raises
        ------
        DiskError
            If the disk takes no file.
        InputError
            As from `all`.
        """
        if not self._path.is_file():
            return
        with self._lock, locked(self._path.parent, wait=True):
            found = dict(self._all())
            if found.get(name) == before:
                del found[name]
                self._write(found)

    def _all(self) -> dict[str, Subset]:
        try:
            status = self._path.stat()
        except OSError:
            return {}
        # Every page asks; the file is read again where it is another one.
        state = (status.st_ino, status.st_size, status.st_mtime_ns)
        if self._read[0] != state:
            self._read = (state, _parsed(self._path))
        return self._read[1]

    def _write(self, selections: Mapping[str, Subset]) -> None:
        values = {name: one.to_dict() for name, one in sorted(selections.items())}
        content = {"format": _FORMAT, "version": _VERSION, "selections": values}
        with write_atomically(self._path) as temporary:
            temporary.write_text(json.dumps(content), encoding="utf-8")


def _parsed(path: Path) -> dict[str, Subset]:
    with reading(str(path), "kept selections"), path.open("rb") as stream:
        text = stream.read(_MOST_BYTES + 1)
        if len(text) > _MOST_BYTES:
            raise InputError(f"{path}: expected {_MOST_BYTES:,} bytes or fewer")
        content = json.loads(text)
    if not isinstance(content, dict) or content.get("format") != _FORMAT:
        raise InputError(f"{path}: expected kept selections, found another file")
    if content.get("version") != _VERSION:
        raise InputError(
            f"{path}: expected version {_VERSION}, found {str(content.get('version'))[:40]!r}"
        )
    selections = content.get("selections")
    if not isinstance(selections, dict):
        raise InputError(f"{path}: expected selections by their names, found none")
    found = {name: _subset(values) for name, values in selections.items()}
    if damaged := [name for name, items in found.items() if items is None]:
        raise InputError(f"{path}: expected ids in each selection, found others in {damaged[0]!r}")
    return {name: items for name, items in found.items() if items is not None}


def _subset(values: Any) -> Subset | None:  # noqa: ANN401 as JSON
    """Return a selection; None if it is none."""
    if not isinstance(values, dict):
        return None
    kinds = [values.get(kind, []) for kind in KINDS]
    if not all(isinstance(kind, list) for kind in kinds):
        return None
    sources, exposures, detectors = kinds
    if not all(type(one) is int for one in (*sources, *detectors)):
        return None
    is_pair = [
        isinstance(pair, list) and [type(n) for n in pair] == [int, int] for pair in exposures
    ]
    if not all(is_pair):
        return None
    pairs = frozenset((field, plate) for field, plate in exposures)
    return Subset(frozenset(sources), pairs, frozenset(detectors))


def _size(selected: Subset) -> int:
    return sum(len(getattr(selected, kind)) for kind in KINDS)
