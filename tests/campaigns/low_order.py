"""Measure how far the detectors' own terms stand for a distortion of higher order than fitted.

    python tests/campaigns/low_order.py [--orbits 20] [--first 6000]

The true distortion of the simulated full orbits is of order 5. Some eight seconds of two cores for
each orbit.
"""

import argparse
import sys
from pathlib import Path

# Import this checkout, whatever the working directory.
sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

# Imported before NumPy, as in the program, because it sets how long idle BLAS threads spin.
import solver  # noqa: F401, I001

import numpy as np

from plateviz.verdict.verdict import orbit_verdict
from solver.data.result import FitResult
from solver.data.settings import FitSettings
from solver.fit import fit_orbit
from tests.benchmarks.machine import write
from tests.campaigns.defects import full_orbit

FITS = {
    "--order 3": FitSettings(order=3),
    "--order 3 --detector-distortion 3": FitSettings(order=3, detector_distortion=3),
    "--order 3 --detector-distortion 4": FitSettings(order=3, detector_distortion=4),
    "--order 5": FitSettings(order=5),
}
FEWEST_MEASUREMENTS = 10


def main() -> int:
    arguments = parse_arguments()
    found: dict[str, list[tuple[float, float, str]]] = {name: [] for name in FITS}
    for seed in range(arguments.first, arguments.first + arguments.orbits):
        data = full_orbit(seed)
        for name, settings in FITS.items():
            result = fit_orbit(data, settings=settings)
            error, pull = error_and_pull(result)
            found[name].append((error, pull, orbit_verdict(result).state))
            write(f"{seed}, {name}: {error:.3f} mas, pulls {pull:.3f}, {found[name][-1][2]}")
    write("\n| fit with | error, mean (mas) | smallest to largest | pulls | not to be trusted |")
    write("|---|---:|---:|---:|---:|")
    for name, of_fit in found.items():
        errors, pulls = (np.array([one[k] for one in of_fit], dtype=float) for k in (0, 1))
        bad = sum(state == "bad" for *_, state in of_fit)
        write(
            f"| `{name}` | {errors.mean():.3f} | {errors.min():.2f} to {errors.max():.2f} |"
            f" {pulls.mean():.2f} | {bad} of {len(of_fit)} |"
        )
    return 0


def error_and_pull(result: FitResult) -> tuple[float, float]:
    """Return rms error, mas, and rms pull of the non-reference sources, in one coordinate."""
    if result.true_places is None:
        raise ValueError("expected an orbit with its truth")
    rows = result.sources.merge(result.true_places, on="source_id", suffixes=("", "_true"))
    rows = rows[~rows["is_reference"] & (rows["n_obs"] >= FEWEST_MEASUREMENTS)]
    ra = 3.6e6 * (rows["ra"] - rows["ra_true"]) * np.cos(np.radians(rows["dec"]))
    dec = 3.6e6 * (rows["dec"] - rows["dec_true"])
    pulls = np.stack([ra / rows["sigma_ra_marginal"], dec / rows["sigma_dec_marginal"]])
    return float(np.sqrt(0.5 * np.mean(ra**2 + dec**2))), float(np.sqrt(np.mean(pulls**2)))


def parse_arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--orbits", type=int, default=20, help="number of full orbits")
    parser.add_argument("--first", type=int, default=6000, help="seed of the first orbit")
    return parser.parse_args()


if __name__ == "__main__":
    sys.exit(main())
