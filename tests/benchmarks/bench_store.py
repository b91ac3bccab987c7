"""Time the queries of a run on generated tables of any number of orbits.

    python tests/benchmarks/bench_store.py [--orbits 6000] [--sources 20000]

The history has the layout that `plateviz survey` writes: in order of source, in groups of rows.
Its values are drawn from 256 numbers, so that thousands of orbits fit on a disk; the number of
values, their types and the columns read are those of a real history. The unit is one pass of
NumPy over as many numbers as the history has rows (`sum` of float64), timed in the same run.
"""

import argparse
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

# Import this checkout, whatever the working directory.
sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import numpy as np
import pandas as pd
import pyarrow as pa
from pyarrow import parquet

from plateviz.runs.gathered_history import rows_of_a_group
from plateviz.runs.run import HISTORY_FILE, MOTIONS_FILE, Run
from plateviz.runs.run_directory import RunDirectory
from solver.data.survey_schema import HISTORY, MOTIONS
from tests.benchmarks.machine import machine, time_of, write

_FIRST_ID = 4_040_000_000_000_000_000
_SOURCES_AT_ONCE = 500
_REPEAT = 5


def main() -> None:
    arguments = parse_arguments()
    with TemporaryDirectory(prefix="plateviz-") as scratch:
        run = Run(RunDirectory(Path(scratch), "made-up"))
        run.directory.mkdir(parents=True)
        write_tables(run.directory, arguments.orbits, arguments.sources)
        rows = arguments.orbits * arguments.sources
        size = (run.directory / HISTORY_FILE).stat().st_size / 2**30
        values = np.ones(rows)
        unit = time_of(values.sum, _REPEAT)
        write(machine())
        write(f"{rows:,} rows of {arguments.orbits} orbits, {size:.1f} GiB; unit {unit:.4f} s\n")
        source = _FIRST_ID + arguments.sources // 2
        for name, query in {
            "history of one source": lambda: run.history(source),
            "counts of all sources": run.counts,
            "scatter of classes of sources": lambda: run.classes(80),
        }.items():
            seconds = time_of(query, _REPEAT)
            write(f"{name:<40}{seconds:9.3f} s{seconds / unit:9.1f} units")


def parse_arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description="Time the queries of a run.")
    parser.add_argument("--orbits", type=int, default=6000)
    parser.add_argument("--sources", type=int, default=20_000, help="in each orbit")
    return parser.parse_args()


def write_tables(directory: Path, orbits: int, sources: int) -> None:
    """Write a history with every source in every orbit, and the motions."""
    rng = np.random.default_rng(0)
    values = rng.standard_normal(256)
    schema = pa.schema([(c.name, pa.type_for_alias(c.dtype)) for c in HISTORY])
    group = rows_of_a_group(orbits * sources)
    with parquet.ParquetWriter(directory / HISTORY_FILE, schema, compression="zstd") as writer:
        for first in range(0, sources, _SOURCES_AT_ONCE):
            table = _rows(rng, values, first, min(_SOURCES_AT_ONCE, sources - first), orbits)
            writer.write_table(table.cast(schema), row_group_size=group)
    motions = {c.name: np.zeros(sources, c.dtype) for c in MOTIONS}
    motions["source_id"] = _FIRST_ID + np.arange(sources)
    pd.DataFrame(motions).to_parquet(directory / MOTIONS_FILE, index=False)


def _rows(
    rng: np.random.Generator, values: np.ndarray, first: int, sources: int, orbits: int
) -> pa.Table:
    n = sources * orbits
    columns = {c.name: values[rng.integers(256, size=n)] for c in HISTORY if c.dtype == "float64"}
    number = np.arange(first, first + sources)
    columns |= {
        "source_id": _FIRST_ID + np.repeat(number, orbits),
        "orbit_id": np.tile(np.arange(orbits), sources),
        "epoch": np.tile(61_000.0 + 0.1 * np.arange(orbits), sources),
        "is_reference": np.repeat(number % 35 == 0, orbits),
        "is_artificial": np.repeat(number % 130 == 1, orbits),
        "n_obs": rng.integers(1, 96, size=n),
    }
    return pa.table({name: columns[name] for name in HISTORY.names})


if __name__ == "__main__":
    main()
