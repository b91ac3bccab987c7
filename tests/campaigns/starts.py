"""Check that fits from wrong starts end at the same solution, or are refused in words.

    python tests/campaigns/starts.py [--starts 500] [--inputs 150] [--records FILE]

A trial displaces one orbit, the first ones (`--inputs`) in two ways. All calibration groups and the
catalogue move by up to ten times their prior widths, uniformly, and the position angle of each
exposure is anywhere.

start : the engine starts there, under the same priors; compared with the undisturbed solution.
input : the tables, the instrument and the settings are displaced, which is how a user gives a
    start. The prior centres move with them, and the solution with the centres. It is therefore
    compared with that of the same displaced input from a start that is displaced once more.

Solutions are the same if no parameter differs by more than 1e-3 of its marginal sigma. A trial may
also end with an `InputError`, a `FitError` or a result that has not converged and gives the reason.
Anything else is a fault, and makes the exit code 1.
"""

import argparse
import lzma
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import cache, partial
from pathlib import Path
from typing import NamedTuple

# Import this checkout, whatever the working directory.
sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

# Imported before NumPy, as in the program, because it sets how long idle BLAS threads spin.
import solver  # noqa: F401, I001

import numpy as np
import pandas as pd

from solver.data.instrument import MINI_MOCK, Instrument
from solver.data.orbit import OrbitData
from solver.data.parameters import BY_NAME, CALIBRATION_GROUPS
from solver.data.result import FitResult
from solver.data.settings import FitSettings
from solver.engines.gauss_newton import Mode, find_mode
from solver.errors import FitError, InputError
from solver.fit import fit_orbit
from solver.io.read_orbit import read_orbit
from solver.data.distortion_terms import terms
from solver.problem.problem import Problem, build_problem
from solver.units import MAS_PER_DEG
from tests.benchmarks.machine import write
from tests.benchmarks.orbits import simulated_orbit, survey_of
from tests.campaigns.coverage import markdown
from tests.campaigns.prior_draws import Size, centre_seen_at, draw_orbit
from tests.campaigns.trials import Record, run_trials

DATA = Path(__file__).resolve().parents[1] / "data"
TOLERANCE = 1e-3
# Largest displacement, in prior widths.
FAR = 10.0
KINDS = ("start", "input")
_TURN = 360.0 * 3600.0


class Vector(NamedTuple):
    """All parameters as offsets from their origins, or their sigmas."""

    theta: np.ndarray
    sources: np.ndarray


class Undisturbed(NamedTuple):
    """An orbit, its problem and its solution from the undisturbed start."""

    data: OrbitData
    problem: Problem
    mode: Mode
    solution: Vector
    sigma: Vector


class Displaced(NamedTuple):
    """An input whose prior centres are displaced."""

    data: OrbitData
    instrument: Instrument
    settings: FitSettings


def main() -> int:
    arguments = parse_arguments()

    def run(number: int) -> Record:
        return trial(number, KINDS if number < arguments.inputs else KINDS[:1])

    records = run_trials(arguments.records, range(arguments.starts), run, after=report)
    rows = table(records)
    write("\n" + markdown(rows) + "\n")
    reasons = Counter(
        f"{kind}: {record[kind]['refused']}"
        for record in records
        for kind in KINDS
        if "refused" in record.get(kind, {})
    )
    for reason, number in reasons.most_common():
        write(f"refused {number} times, {reason}")
    for record in records:
        for kind in KINDS:
            if kind in record and is_fault(record[kind]):
                write(f"fault, {record['orbit']}, {kind}: {record[kind]}")
    return int(rows["faults"].sum() > 0)


def trial(number: int, kinds: Sequence[str] = KINDS) -> Record:
    """Displace the start or the input of an orbit, or both in turn, and return how the fits end."""
    name = list(ORBITS)[number % len(ORBITS)]
    orbit, rng = undisturbed(name), np.random.default_rng([number, 3])
    attempts = {"start": from_start, "input": from_input}
    return {"orbit": name, **{kind: ending(partial(attempts[kind], orbit, rng)) for kind in kinds}}


def sample_orbit() -> OrbitData:
    """Return the sample orbit, made by a program that shares no code with the project."""
    with tempfile.TemporaryDirectory() as folder:
        for packed in sorted(DATA.glob("*.fits.xz")):
            (Path(folder) / packed.stem).write_bytes(lzma.decompress(packed.read_bytes()))
        names = ("sample_obs.fits", "sample_ref.fits")
        return read_orbit(*(Path(folder) / name for name in names))


ORBITS: dict[str, Callable[[], OrbitData]] = {
    "sample orbit": sample_orbit,
    "simulated, 16 exposures": lambda: simulated_orbit(survey_of(900, 16)),
    "simulated, 96 exposures": lambda: simulated_orbit(survey_of(600)),
    "13 references": lambda: draw_orbit(5, Size(13, 700, 6)).data,
    "900 references": lambda: draw_orbit(6, Size(900, 500, 6)).data,
}


@cache
def undisturbed(name: str) -> Undisturbed:
    data, settings = ORBITS[name](), FitSettings()
    problem = build_problem(data, MINI_MOCK, settings)
    solution, sigma = vectors(problem, fit_orbit(data, MINI_MOCK, settings))
    return Undisturbed(data, problem, find_mode(problem, settings), solution, sigma)


def ending(attempt: Callable[[], Record]) -> Record:
    """Return the record of an attempt, or how it was refused, or what it raised."""
    begin = time.perf_counter()
    try:
        found = attempt()
    except (InputError, FitError) as error:
        found = {"refused": f"{type(error).__name__}: {error}"}
    except Exception as error:
        # Recorded, so that one fault does not hide those of the other trials.
        found = {"raised": f"{type(error).__name__}: {error}"}
    return {**found, "seconds": round(time.perf_counter() - begin, 2)}


def from_start(orbit: Undisturbed, rng: np.random.Generator) -> Record:
    """Fit from a displaced start under the same priors."""
    mode = find_mode(orbit.problem, FitSettings(), start=displaced_start(orbit, orbit.problem, rng))
    if not mode.status.is_solution:
        return {"refused": mode.status.value}
    found = Vector(mode.theta, mode.sources)
    return {
        "iterations": len(mode.trace) - 1,
        **difference(orbit.problem, found, orbit.solution, orbit.sigma),
    }


def displaced_start(orbit: Undisturbed, problem: Problem, rng: np.random.Generator) -> Mode:
    """Return a start that is displaced from the prior centres of a problem."""
    width, covariance = problem.priors.width, np.linalg.inv(problem.priors.precision)
    theta = FAR * rng.uniform(-1.0, 1.0, len(width)) * np.where(np.isfinite(width), width, 0.0)
    columns = problem.layout.columns(BY_NAME["position_angle"])
    theta[columns] = rng.uniform(-0.5, 0.5, len(columns)) * _TURN
    spread = np.sqrt(np.diagonal(covariance, axis1=1, axis2=2))
    sources = FAR * rng.uniform(-1.0, 1.0, spread.shape) * spread
    return orbit.mode._replace(theta=theta, sources=sources)


def from_input(orbit: Undisturbed, rng: np.random.Generator) -> Record:
    """Fit displaced input, and the same from a start that is displaced once more."""
    displaced = Displaced(
        replace(
            orbit.data,
            exposures=displaced_exposures(orbit.data.exposures, rng),
            catalogue=displaced_catalogue(orbit.data.catalogue, rng),
        ),
        displaced_instrument(rng),
        displaced_distortion(rng),
    )
    result = fit_orbit(*displaced)
    if not result.summary["converged"]:
        return {"refused": str(result.summary["reason"])}
    problem = build_problem(*displaced)
    found, sigma = vectors(problem, result)
    start = displaced_start(orbit, problem, rng)
    mode = find_mode(problem, displaced.settings, start=start)
    if not mode.status.is_solution:
        return {"refused": f"from the second start: {mode.status.value}"}
    return {
        "iterations": int(result.summary["iterations"]),
        **difference(problem, found, Vector(mode.theta, mode.sources), sigma),
    }


def displaced_exposures(exposures: pd.DataFrame, rng: np.random.Generator) -> pd.DataFrame:
    n = len(exposures)
    offset = FAR * rng.uniform(-1.0, 1.0, (n, 2)) * BY_NAME["pointing_ra"].width
    ra, dec = exposures["ra_est"].to_numpy(), exposures["dec_est"].to_numpy()
    ra, dec = centre_seen_at(ra, dec, offset)
    length = FAR * rng.uniform(-1.0, 1.0, n) * BY_NAME["focal_length"].width
    return exposures.assign(
        ra_est=ra % 360.0,
        dec_est=dec,
        pa_est=rng.uniform(0.0, 360.0, n),
        focal_length=exposures["focal_length"] + length,
    )


def displaced_catalogue(catalogue: pd.DataFrame, rng: np.random.Generator) -> pd.DataFrame:
    moved = {
        axis: FAR
        * rng.uniform(-1.0, 1.0, len(catalogue))
        * catalogue[f"{axis}_error"]
        / MAS_PER_DEG
        for axis in ("ra", "dec")
    }
    return catalogue.assign(
        ra=(catalogue["ra"] + moved["ra"] / np.cos(np.radians(catalogue["dec"]))) % 360.0,
        dec=catalogue["dec"] + moved["dec"],
    )


def displaced_instrument(rng: np.random.Generator) -> Instrument:
    groups = [group for group in CALIBRATION_GROUPS if group.axis == "det"]
    detectors = []
    for detector in MINI_MOCK.detectors:
        moved = {}
        for group, factor in zip(groups, FAR * rng.uniform(-1.0, 1.0, len(groups)), strict=True):
            value = getattr(detector, group.column)
            width = group.width * (abs(value) if group.relative else 1.0 / group.per_value_unit)
            moved[group.column] = float(value + factor * width)
        detectors.append(replace(detector, **moved))
    return replace(MINI_MOCK, detectors=tuple(detectors))


def displaced_distortion(rng: np.random.Generator) -> FitSettings:
    shifts = {
        f"distortion_{axis}[{k}/{j}]": FAR * float(rng.uniform(-1.0, 1.0))
        for axis in "xy"
        for k, j in terms(FitSettings().order)
    }
    return FitSettings(prior_shifts=shifts)


def vectors(problem: Problem, result: FitResult) -> tuple[Vector, Vector]:
    """Return the solution of a result and its marginal sigmas."""
    found = []
    for column, of_sources in (
        ("offset", ["offset_ra", "offset_dec"]),
        ("sigma_marginal", ["sigma_ra_marginal", "sigma_dec_marginal"]),
    ):
        rows = result.calibration.groupby("group")[column]
        theta = problem.layout.gather({name: group.to_numpy() for name, group in rows})
        found.append(Vector(theta, result.sources[of_sources].to_numpy()))
    return found[0], found[1]


def difference(problem: Problem, found: Vector, expected: Vector, sigma: Vector) -> Record:
    """Return the largest difference of two solutions in sigmas, and the group it is in."""
    moved = found.theta - expected.theta
    columns = problem.layout.columns(BY_NAME["position_angle"])
    moved[columns] = np.remainder(moved[columns] + 0.5 * _TURN, _TURN) - 0.5 * _TURN
    in_sigmas = problem.layout.scatter(np.abs(moved) / sigma.theta)
    largest = {name: float(values.max()) for name, values in in_sigmas.items()}
    largest["sources"] = float((np.abs(found.sources - expected.sources) / sigma.sources).max())
    group = max(largest, key=lambda name: largest[name])
    return {"difference": largest[group], "group": group}


def is_fault(one: Record) -> bool:
    return "refused" not in one and not one.get("difference", np.inf) <= TOLERANCE


def table(records: Sequence[Record]) -> pd.DataFrame:
    """Return a row for each orbit and kind of displacement."""
    rows = []
    for name in ORBITS:
        for kind in KINDS:
            of_orbit = [record for record in records if record["orbit"] == name]
            of_kind = [record[kind] for record in of_orbit if kind in record]
            solved = [one for one in of_kind if "difference" in one]
            same = [one["difference"] for one in solved if one["difference"] <= TOLERANCE]
            rows.append(
                {
                    "orbit": name,
                    "displaced": kind,
                    "starts": len(of_kind),
                    "same solution": len(same),
                    "largest difference, sigma": f"{max(same, default=np.nan):.1e}",
                    "most iterations": max((one["iterations"] for one in solved), default=0),
                    "refused": sum("refused" in one for one in of_kind),
                    "faults": sum(is_fault(one) for one in of_kind),
                }
            )
    return pd.DataFrame(rows)


def report(number: int, record: Record) -> None:
    write(f"{number}: {record}")


def parse_arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description="Check that fits from wrong starts agree.")
    parser.add_argument("--starts", type=int, default=500)
    parser.add_argument("--inputs", type=int, default=150, help="trials with displaced input too")
    parser.add_argument("--records", type=Path, default=Path("starts.jsonl"))
    return parser.parse_args()


if __name__ == "__main__":
    sys.exit(main())
