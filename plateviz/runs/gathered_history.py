"""The history of all orbits of a run in one file, sorted by source: one is found at once."""

from pathlib import Path

import duckdb

from plateviz.runs.run_directory import HISTORY_FILE, RunDirectory
from solver.io.atomic import write_atomically
from solver.io.parquet import count_rows, write_batches

# Row groups of the gathered file. Small groups are fast to read, because a source is in one or
# two of them; many groups are slow, because the statistics of all groups are read first.
_SMALLEST_GROUP = 8192
_MOST_GROUPS = 1000


def rows_of_a_group(n_rows: int) -> int:
    """Return the number of rows per row group in a gathered history of `n_rows` rows."""
    return max(_SMALLEST_GROUP, n_rows // _MOST_GROUPS)


def gather_history(run: RunDirectory) -> Path:
    """Write the history of all fitted orbits sorted by source and epoch; return its path."""
    target = run.directory / HISTORY_FILE
    parts = [str(run.orbit_directory(orbit) / HISTORY_FILE) for orbit in run.complete_orbits()]
    group = rows_of_a_group(sum(map(count_rows, parts)))
    # With one thread the written bytes are reproducible.
    with write_atomically(target) as temporary, duckdb.connect(config={"threads": 1}) as connection:
        # Where memory does not suffice; by default it is a folder in the working directory.
        connection.execute("SET temp_directory = ?", [str(temporary.parent / "sorting")])
        ordered = connection.sql(
            "SELECT * FROM read_parquet(?, hive_partitioning = false) ORDER BY source_id, epoch",
            params=[parts],
        )
        # DuckDB writes no checksums.
        write_batches(ordered.to_arrow_reader(group), temporary)
    return target
