"""Time `plateviz fit` in a new process on a full-size orbit, with and without a compilation cache.

    python tests/benchmarks/bench_cold.py [--sources 6480] [--repeat 3]

The wall time is that of the whole command: start of Python, imports, reading FITS, the fit
with all tables, writing FITS. With cached compilations the limit is 12 s and the goal 8 s. The
unit is that of `bench_fit.py`. The file cache of the operating system is warm.
"""

import argparse
import json
import os
import statistics
import subprocess
import sys
import time
from collections.abc import Iterator, Mapping
from pathlib import Path
from tempfile import TemporaryDirectory

# Import this checkout, whatever the working directory.
sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

# Imported before NumPy, as in the program, because it sets how long idle BLAS threads spin.
import solver  # noqa: F401, I001

import pandas as pd
from astropy.io import fits
from astropy.table import Table

from solver.data.instrument import MINI_MOCK
from solver.data.orbit import OrbitData
from solver.problem.problem import build_problem
from solver.data.settings import FitSettings
from tests.benchmarks.machine import device, machine, time_of, write
from tests.benchmarks.orbits import SOURCES_OF_THE_PAPER, simulated_orbit, survey_of
from tests.benchmarks.stages import UNIT_REPEATS, unit_product

REPOSITORY = Path(__file__).resolve().parents[2]
IMPORTS = "import plateviz.cli.fit, solver.fit, solver.io.result"


def main() -> None:
    parser = argparse.ArgumentParser(description="Time one fit in a new process.")
    parser.add_argument("--sources", type=int, default=SOURCES_OF_THE_PAPER)
    parser.add_argument(
        "--repeat", type=int, default=3, help="runs of each command; medians are reported"
    )
    arguments = parser.parse_args()
    data = simulated_orbit(survey_of(arguments.sources))
    unit = time_of(unit_product(build_problem(data, MINI_MOCK, FitSettings())), UNIT_REPEATS)
    write(f"{machine()}\nJAX on {device()}")
    write(f"{len(data.measurements)} measurements; unit: {unit:.4f} s\n")
    write(f"{'':<44}{'seconds':>9}{'units':>9}{'CPU s':>9}")
    with TemporaryDirectory() as folder:
        write_files(data, Path(folder))
        for name, (wall, cpu) in timings(Path(folder), arguments.repeat):
            write(f"{name:<44}{wall:9.2f}{wall / unit:9.1f}" + (f"{cpu:9.2f}" if cpu else ""))


def write_files(data: OrbitData, folder: Path) -> None:
    """Write OBS.fits and REF.fits, in the published layout."""
    observation = {"measurement": data.measurements, "environment": data.exposures}
    for name, tables in (("OBS", observation), ("REF", {"catalogue": data.catalogue})):
        hdus = fits.HDUList([fits.PrimaryHDU(), *map(_hdu, tables, tables.values())])
        hdus.writeto(folder / f"{name}.fits", checksum=True)


def _hdu(name: str, frame: pd.DataFrame) -> fits.BinTableHDU:
    hdu = fits.table_to_hdu(Table.from_pandas(frame))
    hdu.name = name
    return hdu


def timings(folder: Path, repeat: int) -> Iterator[tuple[str, tuple[float, float | None]]]:
    """Yield the name of each command, and the medians of its wall time and CPU time, s."""
    yield (
        "Python and its imports",
        medians([run(["-c", IMPORTS], folder)[1] for _ in range(repeat)]),
    )
    yield (
        "plateviz fit, empty compilation cache",
        medians([fit(folder / f"{i}", folder)[1] for i in range(repeat)]),
    )
    cached = [fit(folder / "0", folder) for _ in range(repeat)]
    yield "plateviz fit, cached compilations", medians([seconds for _, seconds in cached])
    summaries = [json.loads(output)["seconds"] for output, _ in cached]
    for stage in summaries[0]:
        wall = statistics.median(summary[stage] for summary in summaries)
        yield f"  of which {stage}", (wall, None)


def fit(cache: Path, folder: Path) -> tuple[str, tuple[float, float]]:
    command = [
        "-m",
        "plateviz.cli.main",
        "fit",
        "OBS.fits",
        "REF.fits",
        "-o",
        "RESULT.fits",
        "--json",
    ]
    return run(command, folder, {"JAX_COMPILATION_CACHE_DIR": str(cache)})


def run(
    command: list[str], folder: Path, variables: Mapping[str, str] | None = None
) -> tuple[str, tuple[float, float]]:
    """Run Python in a new process and return its output, wall time and CPU time, s."""
    environment = {**os.environ, "PYTHONPATH": str(REPOSITORY), **(variables or {})}
    before, start = os.times(), time.perf_counter()
    completed = subprocess.run(
        [sys.executable, *command],
        cwd=folder,
        env=environment,
        check=True,
        stdout=subprocess.PIPE,
        text=True,
    )
    wall, after = time.perf_counter() - start, os.times()
    cpu = (
        after.children_user + after.children_system - before.children_user - before.children_system
    )
    return completed.stdout, (wall, cpu)


def medians(pairs: list[tuple[float, float]]) -> tuple[float, float]:
    return statistics.median(wall for wall, _ in pairs), statistics.median(cpu for _, cpu in pairs)


if __name__ == "__main__":
    main()
