"""Compare how far the positions are off with what the verdict says of it.

    python tests/campaigns/harms.py [--orbits 8] [--defects TEXT ...]

Each sparse orbit is fitted without and with a defect, with the same noise. The figure is the rms
difference of the non-reference positions with ten measurements or more, along one axis, over the
size of the first pattern that the verdict finds. What it says at most is twice that size.
"""

import argparse
import sys
from functools import cache
from pathlib import Path

# Import this checkout, whatever the working directory.
sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

# Imported before NumPy, as in the program, because it sets how long idle BLAS threads spin.
import solver  # noqa: F401, I001

import numpy as np

from solver.data.result import FitResult
from solver.fit import fit_orbit
from solver.results.diagnosis.causes import find_causes
from solver.results.diagnosis.table import diagnose
from solver.units import MAS_PER_DEG
from tests.benchmarks.machine import write
from tests.campaigns.defects import sparse_orbit

_MIN_OBS = 10
_DEFECTS = (
    "detector-shift=0.2um",
    "detector-shift=0.6um",
    "detector-turn=3arcsec",
    "detector-turn=8arcsec",
    "distortion-drift=0.15um",
    "distortion-drift=0.4um",
    "distortion-orbital=0.1um",
    "distortion-orbital=0.3um",
    "distortion-order=0.1um",
    "distortion-order=0.3um",
    "distortion-step=120nm",
    "distortion-step=300nm",
    "charge-transfer=4mpix",
    "satellite-velocity=30km/s",
)


def main() -> None:
    arguments = parse_arguments()
    write("| defect | orbits | least | median | most |\n|---|---:|---:|---:|---:|")
    everything = []
    for defect in arguments.defects:
        found = [ratio(seed, defect) for seed in range(arguments.orbits)]
        ratios = [one for one in found if one is not None]
        everything += ratios
        write(row(defect, ratios))
    write(row("all", everything))


def ratio(seed: int, defect: str) -> float | None:
    """Return the shift of the positions over the size of the first pattern; None without one."""
    result = fit_orbit(sparse_orbit(seed, (defect,)))
    diagnosis = diagnose(result)
    sizes = [one.test.size_um for one in find_causes(diagnosis).found]
    sizes = [size for size in sizes if np.isfinite(size)]
    return shift(result, without(seed)) / diagnosis.camera.on_sky(sizes[0]) if sizes else None


@cache
def without(seed: int) -> FitResult:
    """Return the solution of an orbit without a defect."""
    return fit_orbit(sparse_orbit(seed))


def shift(result: FitResult, other: FitResult) -> float:
    """Return the rms difference of two solutions' positions along one axis, mas."""
    rows = result.sources.merge(other.sources, on="source_id", suffixes=("", "_other"))
    rows = rows[~rows["is_reference"].astype(bool) & (rows["n_obs"] >= _MIN_OBS)]
    ra = (rows["ra"] - rows["ra_other"]) * np.cos(np.deg2rad(rows["dec"]))
    both = np.concatenate([ra, rows["dec"] - rows["dec_other"]])
    return MAS_PER_DEG * float(np.sqrt(np.mean(both**2)))


def row(name: str, ratios: list[float]) -> str:
    """Return a row of the table."""
    if not ratios:
        return f"| `{name}` | 0 | | | |"
    least, median, most = np.percentile(ratios, [0, 50, 100])
    return f"| `{name}` | {len(ratios)} | {least:.2f} | {median:.2f} | {most:.2f} |"


def parse_arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description="Compare shifts of positions with the verdict.")
    parser.add_argument("--orbits", type=int, default=8, help="of each defect")
    parser.add_argument("--defects", nargs="+", default=_DEFECTS, help="as of `plateviz simulate`")
    return parser.parse_args()


if __name__ == "__main__":
    main()
