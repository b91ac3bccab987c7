"""FileRows: the rows of one table in the files of a run, of which single columns are read."""

from collections.abc import Callable, Hashable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from pathlib import Path
from typing import NamedTuple

import numpy as np

from plateviz.runs.column_cache import Arrays, ColumnCache
from solver.data.columns import Column, Table
from solver.data.plural import plural
from solver.errors import InputError
from solver.io.parquet import count_rows, read_columns
from solver.runtime.threads import count_cores

Compute = Callable[[Mapping[str, np.ndarray], Path], np.ndarray]
"""Columns of a file, and the folder that it is in -> values of another column."""


class DerivedColumn(NamedTuple):
    """A column that is computed from those of the files.

    Attributes
    ----------
    column : its definition
    needs : names of the columns that it is computed from
    compute : computes it for one file
    """

    column: Column
    needs: tuple[str, ...]
    compute: Compute


class RowKind(NamedTuple):
    """What the rows of the files are.

    Attributes
    ----------
    table : definition of the columns in the files
    derived : columns that are computed
    is_single : whether four bytes per number suffice, which have seven digits
    precise : names of columns that need eight bytes all the same
    """

    table: Table
    derived: tuple[DerivedColumn, ...]
    is_single: bool
    precise: tuple[str, ...] = ()


class FileRows:
    """The rows of several files, one file after the other.

    Attributes
    ----------
    size : number of rows
    starts : number of the first row of each file
    """

    def __init__(
        self, kind: RowKind, files: Sequence[Path], state: Hashable, kept: ColumnCache
    ) -> None:
        """Count the rows.

        Parameters
        ----------
        state : differs if any of the files is another one
        kept : keeps the columns that were read

        Raises
        ------
        InputError
            If a file is missing or damaged.
        """
        self._kind, self._files = kind, list(files)
        self._state, self._kept = state, kept
        sizes = [count_rows(str(path)) for path in self._files]
        ends = np.cumsum([0, *sizes])
        self.size, self.starts = int(ends[-1]), ends[:-1]
        self._places = [slice(*ends[k : k + 2].tolist()) for k in range(len(sizes))]

    def read(self, name: str) -> np.ndarray:
        """Return a column; InputError if a file is damaged."""
        return self._kept.arrays((self._state, name), partial(self._column, name))[0]

    def sources(self) -> tuple[np.ndarray, np.ndarray]:
        """Return the ids of the sources, ascending, and the place among them for each row."""
        ids, codes = self._kept.arrays((self._state, "source_id"), self._sources)
        return ids, codes

    def _column(self, name: str) -> Arrays:
        derived = {one.column.name: one for one in self._kind.derived}
        needs = derived[name].needs if name in derived else (name,)
        is_single = self._kind.is_single and name not in self._kind.precise
        found = np.empty(self.size, dtype=np.float32 if is_single else np.float64)

        def read(path: Path, place: slice) -> None:
            columns = self._of_file(path, needs, place)
            if name in derived:
                found[place] = derived[name].compute(columns, path.parent)
            else:
                found[place] = columns[name]

        self._for_each_file(read)
        return (found,)

    def _sources(self) -> Arrays:
        codes = np.empty(self.size, dtype=np.int32)
        dictionaries: dict[int, np.ndarray] = {}

        def read(path: Path, place: slice) -> None:
            table = read_columns(path, ["source_id"])
            coded = table["source_id"].combine_chunks().dictionary_encode()
            self._require(path, len(coded), place)
            dictionaries[place.start] = coded.dictionary.to_numpy()
            codes[place] = coded.indices.to_numpy()

        self._for_each_file(read)
        ids = np.unique(np.concatenate([np.zeros(0, dtype=np.int64), *dictionaries.values()]))
        for place in self._places:
            if place.start in dictionaries:
                of_file = np.searchsorted(ids, dictionaries[place.start]).astype(np.int32)
                codes[place] = of_file[codes[place]]
        return ids, codes

    def _of_file(self, path: Path, needs: tuple[str, ...], place: slice) -> dict[str, np.ndarray]:
        table = read_columns(path, list(needs))
        self._require(path, table.num_rows, place)
        return {name: table[name].to_numpy() for name in needs}

    def _require(self, path: Path, n_rows: int, place: slice) -> None:
        wanted = place.stop - place.start
        if n_rows != wanted:
            raise InputError(
                f"{path}: expected {wanted:,} {plural(wanted, 'row')} as before, found {n_rows:,}"
            )

    def _for_each_file(self, read: Callable[[Path, slice], None]) -> None:
        """Read all files, as many at a time as there are cores."""
        with ThreadPoolExecutor(max(1, count_cores())) as pool:
            waiting = [
                pool.submit(read, path, place)
                for path, place in zip(self._files, self._places, strict=True)
                if place.stop > place.start
            ]
            try:
                for one in waiting:
                    one.result()
            finally:
                # After a failure, the other files are not waited for.
                for one in waiting:
                    one.cancel()
