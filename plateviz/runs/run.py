"""A run of a survey, to be read: queries over its orbits, answered from its files by DuckDB.

Each orbit's directory contains its part of the history. After orbits are added, the parts are
gathered into one file sorted by source, from which one source can be read without the rest.
"""

from collections.abc import Hashable, Mapping
from pathlib import Path

import duckdb
import numpy as np
import pandas as pd
from pyarrow.compute import Expression
from pyarrow.compute import field as col

from plateviz.runs.fitted_orbit import is_complete, kept_table, read_summary
from plateviz.runs.orbit_cache import OrbitCache
from plateviz.runs.orbit_of_run import read_orbit
from plateviz.runs.run_directory import (
    ERRORS_FILE,
    HISTORY_FILE,
    MOTIONS_FILE,
    RUN_FILE,
    RunDirectory,
    RunProgress,
    run_directories,
)
from solver.data.result import FitResult
from solver.data.survey_schema import ERRORS_BY_COUNT, HISTORY, MOTIONS, RUN_ORBITS
from solver.errors import InputError
from solver.io.failures import reading, reason_of
from solver.io.manifest import UnchangedFiles
from solver.io.parquet import read_frame
from solver.io.result_instrument import require_instrument
from solver.io.survey import read_survey_instrument, survey_orbits

# The classes are those of `plateviz.tables.sources`.
_CLASSES = """
WITH rows AS (
    SELECT *, count(*) OVER (PARTITION BY source_id) AS n_orbits,
        CASE WHEN is_reference THEN 'reference' WHEN is_artificial THEN 'artificial'
             ELSE 'non-reference' END AS source_class,
        pow(offset_ra - true_offset_ra, 2) + pow(offset_dec - true_offset_dec, 2) AS square
    FROM read_parquet(?)
)
SELECT source_class,
    sqrt(avg(square) / 2) AS rms_deviation,
    sqrt(avg(pow(prior_sigma_ra, 2) + pow(prior_sigma_dec, 2)) / 2) AS rms_prior_sigma,
    sqrt(avg(n_obs * pow(sigma_ra_conditional, 2))) AS sigma_single,
    median(sigma_ra_marginal) FILTER (n_orbits > ?) AS sigma_often
FROM rows GROUP BY source_class ORDER BY source_class
"""


class Run:
    """One run of a survey; its methods read files and keep nothing large in memory."""

    def __init__(self, directory: RunDirectory, cache: OrbitCache | None = None) -> None:
        """Open a run, complete or not; `cache` is of its fitted orbits."""
        self._files, self._cache = directory, cache
        self._unchanged, self._had_history = UnchangedFiles(), False
        self._first_header = self._header_bytes()

    @property
    def name(self) -> str:
        """Name of the run."""
        return self._files.name

    @property
    def survey(self) -> Path:
        """The survey's directory."""
        return self._files.survey

    @property
    def directory(self) -> Path:
        """The run's directory."""
        return self._files.directory

    @property
    def is_complete(self) -> bool:
        """Whether every orbit of the survey is fitted and gathered."""
        return self._files.is_complete

    @property
    def is_gathered(self) -> bool:
        """Whether the tables over all orbits are there: of all orbits or of those not failed."""
        return self._files.is_gathered

    def is_there(self) -> bool:
        """Return whether nobody has removed the run; costs one look at its directory."""
        return self.directory.is_dir()

    def is_replaced(self) -> bool:
        """Return whether another run has its name since it was opened; costs a look at a file."""
        now = self._header_bytes()
        self._first_header = self._first_header or now
        return now not in (b"", self._first_header)

    def _header_bytes(self) -> bytes:
        """Return what the run began with; empty while it is not there."""
        try:
            return (self.directory / RUN_FILE).read_bytes()
        except OSError:
            return b""

    def progress(self) -> RunProgress:
        """Return what the run has now; takes a millisecond for each hundred orbits."""
        return self._files.progress()

    def stamp(self) -> Hashable:
        """Return what differs once anything of the run is written; InputError if it is gone."""
        with reading(str(self.directory), "a run"):
            found = [path.stat() for path in (self.directory, self.survey)]
        return self.progress(), *((one.st_ino, one.st_mtime_ns) for one in found)

    def header(self) -> Mapping[str, object]:
        """Return the header of the run: `settings`, `versions`, hashes of the `inputs`."""
        return self._files.header()

    def failures(self) -> dict[int, str]:
        """Return the reasons why orbits have no solution, by orbit."""
        return self._files.failures()

    def has_fitted(self, orbit: int) -> bool:
        """Return whether the run has a solution of an orbit."""
        return is_complete(self._files.orbit_directory(orbit))

    def orbits(self) -> pd.DataFrame:
        """Return `survey_schema.RUN_ORBITS`, a row per orbit of the survey."""
        complete, failures = set(self._files.complete_orbits()), self._files.failures()
        rows = []
        for orbit in survey_orbits(self.survey):
            row: dict[str, object] = {"orbit_id": orbit, "status": "missing"}
            row |= dict.fromkeys(("message", "state"), "")
            if orbit in complete:
                row |= {"status": "complete", **self._figures(orbit)}
            elif orbit in failures:
                row |= {"status": "failed", "message": failures[orbit]}
            rows.append(row)
        kinds = {c.name: np.float64 for c in RUN_ORBITS if c.dtype == "float64"}
        table = pd.DataFrame(rows, columns=RUN_ORBITS.names)
        return table.astype({**kinds, "orbit_id": np.int64})

    def motions(self) -> pd.DataFrame:
        """Return `survey_schema.MOTIONS`; no rows until the orbits are gathered."""
        if not self.is_gathered:
            return pd.DataFrame(columns=MOTIONS.names)
        return self._table(MOTIONS_FILE)

    def motion(self, source_id: int) -> pd.Series | None:
        """Return the row of one source in `motions`, or None."""
        if not self.is_gathered:
            return None
        found = self._table(MOTIONS_FILE, rows=col("source_id") == int(source_id))
        # Without the conversion pandas would make the ids of a row floating-point numbers.
        return None if found.empty else found.astype(object).iloc[0]

    def errors_by_count(self) -> pd.DataFrame | None:
        """Return `survey_schema.ERRORS_BY_COUNT` of the artificial sources, or None."""
        if not (self.directory / ERRORS_FILE).is_file():
            self._files.require_unchanged(ERRORS_FILE)
            return None
        return self._table(ERRORS_FILE, ERRORS_BY_COUNT.names)

    def test_table(self, name: str) -> pd.DataFrame | None:
        """Return one of the tables from which the run is tested; None if it has none."""
        if not self.is_gathered or not (self.directory / name).is_file():
            self._files.require_unchanged(name)
            return None
        return self._table(name)

    def history(self, source_id: int) -> pd.DataFrame:
        """Return `survey_schema.HISTORY` of one source by epoch; no rows if it is unknown."""
        if not self._has_history():
            return pd.DataFrame(columns=HISTORY.names)
        rows = col("source_id") == int(source_id)
        parts = [read_frame(Path(file), HISTORY.names, rows) for file in self.history_files()]
        if not parts:
            # There were some before.
            raise InputError(f"{self.directory}: expected fitted orbits, found none any more")
        found = pd.concat(parts, ignore_index=True)
        return found.sort_values("epoch", ignore_index=True, kind="stable")

    def counts(self) -> pd.DataFrame:
        """Return source_id, is_reference, is_artificial, n_orbits and n_obs of every source."""
        names = ["source_id", "is_reference", "is_artificial", "n_orbits", "n_obs"]
        if self.is_gathered:
            return self._table(MOTIONS_FILE, names)
        if not self._has_history():
            kinds = {"is_reference": bool, "is_artificial": bool}
            return pd.DataFrame(columns=names).astype(dict.fromkeys(names, np.int64) | kinds)
        return self._ask(
            "SELECT source_id, any_value(is_reference) AS is_reference, "
            "any_value(is_artificial) AS is_artificial, count(*) AS n_orbits, "
            "sum(n_obs)::BIGINT AS n_obs FROM read_parquet(?) "
            "GROUP BY source_id ORDER BY source_id",
            self.history_files(),
        )

    def classes(self, often: int) -> pd.DataFrame:
        """Return statistics over all orbits for each class of sources, by `source_class`.

        Parameters
        ----------
        often : `sigma_often` is of sources measured in more orbits than this

        Returns
        -------
        `rms_deviation` from the truth and `rms_prior_sigma` in one coordinate, `sigma_single`
        (rms conditional sigma times sqrt(n_obs)) and `sigma_often` (median marginal sigma in
        RA of sources measured often), mas
        """
        return self._ask(_CLASSES, self.history_files(), often).set_index("source_class")

    def result(self, orbit: int) -> FitResult:
        """Return one fitted orbit.

        Raises
        ------
        InputError
            If it is not there, or is another one, or the survey has another instrument now.
        """
        read, directory = self._cache and self._cache.read, self._files.orbit_directory(orbit)
        result, where = read_orbit(directory, orbit, read), f"{self.directory}: orbit {orbit}"
        expected, remedy = read_survey_instrument(self.survey), "fit the orbits in another run"
        require_instrument(result, expected, where, remedy)
        return result

    def expect(self, orbit: int | None) -> None:
        """Read a fitted orbit ahead, which is likely to be asked for next, if it exists."""
        if orbit is not None and self._cache is not None and self.has_fitted(orbit):
            self._cache.expect(self._files.orbit_directory(orbit))

    def _has_history(self) -> bool:
        """Return whether the run has a history, or had one before it was removed."""
        is_there = (self.directory / HISTORY_FILE).is_file() or bool(self._files.complete_orbits())
        self._had_history |= is_there
        return self._had_history

    def history_files(self) -> list[str]:
        """Return the gathered history, or its parts; InputError if a file is damaged.

        Each is read as a whole once: checksums of pages do not protect the names of columns.
        """
        gathered = self.directory / HISTORY_FILE
        if self.is_complete or gathered.is_file():
            self._files.require_unchanged(HISTORY_FILE, self._unchanged.require)
            return [str(gathered)]
        orbits = map(self._files.orbit_directory, self._files.complete_orbits())
        return [str(kept_table(orbit, "history", self._unchanged)) for orbit in orbits]

    def _figures(self, orbit: int) -> dict[str, object]:
        directory = self._files.orbit_directory(orbit)
        summary = read_summary(directory)
        with reading(str(directory), "the summary of a fitted orbit"):
            figures = {name: summary.get(name) for name in RUN_ORBITS.names if name in summary}
            seconds = sum(float(value) for value in summary["seconds"].values())
            # Older versions wrote no verdict.
            figures["state"] = (summary.get("verdict") or {}).get("state", "")
            return {**figures, "epoch": summary["epoch_mjd"], "seconds": seconds}

    def _table(
        self, name: str, columns: list[str] | None = None, rows: Expression | None = None
    ) -> pd.DataFrame:
        """Return a table over all orbits, checked as a whole if the run is complete."""
        self._files.require_unchanged(name)
        return read_frame(self.directory / name, columns, rows)

    def _ask(self, question: str, *values: object) -> pd.DataFrame:
        try:
            with duckdb.connect() as connection:
                return connection.execute(question, list(values)).df()
        except duckdb.Error as error:
            message = f"{self.directory}: expected the tables of a run, found {reason_of(error)}"
            raise InputError(message) from error


def survey_runs(survey: Path, cache: OrbitCache | None = None) -> list[Run]:
    """Return the runs of a survey directory, by name; `cache` is of their fitted orbits."""
    return [Run(directory, cache) for directory in run_directories(survey)]


def open_run(survey: Path, name: str) -> Run:
    """Return a run of a survey.

    Raises
    ------
    InputError
        If the survey has no run of that name.
    """
    runs = {run.name: run for run in survey_runs(survey)}
    if name in runs:
        return runs[name]
    names = ", ".join(runs) or "none"
    message = f"{survey}: expected a run {name!r}, found {names}; `plateviz survey` creates one"
    raise InputError(message)
