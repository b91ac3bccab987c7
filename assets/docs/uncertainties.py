"""Compute the numbers of uncertainties.md: sigmas, scatter and offsets over simulated orbits.

    python assets/docs/uncertainties.py [--orbits 8] [--stars N] [--seed 0]

Orbits of the mini-mock survey are simulated and solved; what the linearised problem predicts
for every source is compared with its deviations from the truth from orbit to orbit.
"""

import argparse
import sys
from collections.abc import Callable, Sequence
from pathlib import Path

# Use the checkout, not an installed copy.
sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

# Before NumPy: it sets how long idle BLAS threads spin.
import solver  # noqa: F401, I001

import numpy as np
import pandas as pd

from solver.results.diagnostics import error_budget, mean_covariance
from solver.engines.estimate import Estimate
from solver.engines.gauss_newton import find_mode
from solver.data.instrument import MINI_MOCK
from solver.data.orbit import OrbitData
from solver.problem.problem import build_problem
from solver.data.settings import FitSettings
from solver.simulate.catalogue import reference_catalogue, truth_catalogue
from solver.simulate.measure import measure_orbit
from solver.simulate.settings import SurveySettings
from solver.results.summary import class_members
from solver.results.tables import SolvedProblem, solved_problem, source_table, true_places
from solver.units import MAS_PER_DEG

KINDS = ("reference", "non-reference", "artificial")
AXES = ("ra", "dec")
# Minimum share of the orbits in which a counted source was measured.
LEAST_SHARE = 0.5
UAS_PER_MAS = 1000.0
SIGMA_OBS_UAS = 4000.0
# Numbers of the paper for reference stars, section "Discussion", uas.
PAPER_REPORTED, PAPER_SCATTER = 100.0, 30.0
COUNTS = (24, 36, 48, 72, 96)


def main(arguments: Sequence[str] | None = None) -> None:
    """Print all tables."""
    parser = argparse.ArgumentParser(description="Compute the numbers of uncertainties.md.")
    parser.add_argument("--orbits", type=int, default=8, help="at least 2")
    parser.add_argument("--stars", type=int, help="in the catalogue; default: the paper's")
    parser.add_argument("--seed", type=int, default=0)
    asked = parser.parse_args(arguments)
    if asked.orbits < 2:
        parser.error(f"expected at least 2 orbits, found {asked.orbits}")
    settings = SurveySettings(orbits=asked.orbits, seed=asked.seed)
    sources, means = solve(settings if asked.stars is None else settings.scaled(asked.stars))
    least = max(2, int(np.ceil(LEAST_SHARE * asked.orbits)))
    write(
        f"{asked.orbits} orbits, seed {asked.seed}; sources measured in at least {least} of them; "
        f"uas, per coordinate unless said otherwise\n"
    )
    write(f"{'':<62}" + "".join(f"{kind:>15}" for kind in KINDS))
    count = sources.groupby(["source_id", "axis"])["orbit"].transform("count")
    for table, figures in ((sources[count >= least], FIGURES), (means, MEAN_FIGURES)):
        of_kind = [table[table["kind"] == kind] for kind in KINDS]
        for label, figure_of in figures.items():
            write(f"{label:<62}" + "".join(f"{figure_of(rows):>15}" for rows in of_kind))
        write("")
    for label, values in single_star().items():
        write(f"{label:<62}" + "".join(f"{value:>9.0f}" for value in values))


def solve(settings: SurveySettings) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Simulate and solve every orbit; return `source_rows` and `mean_rows` of all of them."""
    truth = truth_catalogue(settings)
    catalogue = reference_catalogue(truth, settings)
    sources, means = [], []
    for orbit_id in range(settings.orbits):
        measured = measure_orbit(orbit_id, truth, settings)
        data = OrbitData(measured.measurements, measured.exposures, catalogue, truth)
        problem = build_problem(data, MINI_MOCK, FitSettings())
        mode = find_mode(problem, FitSettings())
        if mode.reduced is None or not mode.status.is_solution:
            sys.exit(f"orbit {orbit_id}: {mode.status.value}")
        solution = solved_problem(problem, Estimate(mode), mode.reduced)
        sources.append(source_rows(solution, truth).assign(orbit=orbit_id))
        means.append(mean_rows(solution, sources[-1]))
    return pd.concat(sources), pd.concat(means)


def source_rows(solution: SolvedProblem, truth: pd.DataFrame) -> pd.DataFrame:
    """Return a row for each source and axis of one orbit: deviation, its parts, and sigmas, uas."""
    table, places = source_table(solution), pd.DataFrame(true_places(solution, truth))
    members = class_members(table)
    budget = error_budget(solution.reduced, solution.problem.priors, solution.covariance)
    cos_dec = np.cos(np.radians(table["dec"]))
    parts = []
    for i, axis in enumerate(AXES):
        scale = UAS_PER_MAS * MAS_PER_DEG * (cos_dec if axis == "ra" else 1.0)
        part = {
            "source_id": table["source_id"],
            "kind": np.select([members[kind] for kind in KINDS], KINDS, ""),
            "axis": axis,
            "n_obs": table["n_obs"],
            "correlation": table["corr_conditional"].abs(),
            "deviation": scale * (table[axis] - places[axis]),
            "induced": UAS_PER_MAS * places[f"induced_{axis}"],
            "sigma_prior": UAS_PER_MAS * table[f"prior_sigma_{axis}"],
            "sigma_data": SIGMA_OBS_UAS / np.sqrt(table["n_obs"]),
            "normalised": table[f"offset_{axis}"] / table[f"prior_sigma_{axis}"],
            **{
                f"sigma_{kind}": UAS_PER_MAS * table[f"sigma_{axis}_{kind}"]
                for kind in ("conditional", "marginal")
            },
            **{
                f"sigma_{name}": UAS_PER_MAS * np.sqrt(np.maximum(covariance[:, i, i], 0.0))
                for name, covariance in budget._asdict().items()
            },
        }
        parts.append(pd.DataFrame(part))
    return pd.concat(parts, ignore_index=True)


def mean_rows(solution: SolvedProblem, rows: pd.DataFrame) -> pd.DataFrame:
    """Return, for each class and axis, the deviation of the mean position and its sigmas."""
    members = class_members(source_table(solution))
    parts = []
    for kind in KINDS:
        covariance = mean_covariance(solution.reduced, members[kind].to_numpy(bool))
        for i, axis in enumerate(AXES):
            chosen = rows[(rows["kind"] == kind) & (rows["axis"] == axis)]
            part = {
                "kind": kind,
                "n": len(chosen),
                "sigma_conditional": rms(chosen["sigma_conditional"]) / np.sqrt(len(chosen)),
                "sigma_marginal": UAS_PER_MAS * np.sqrt(covariance[i, i]),
                "deviation": chosen["deviation"].mean(),
                "induced": chosen["induced"].mean(),
            }
            parts.append(part)
    return pd.DataFrame(parts)


def within(rows: pd.DataFrame, name: str) -> float:
    """Return the scatter of a quantity about each source's own mean over the orbits."""
    groups = rows.groupby(["source_id", "axis"])[name]
    freedom = len(rows) - groups.ngroups
    return float(np.sqrt(((rows[name] - groups.transform("mean")) ** 2).sum() / freedom))


def predicted(rows: pd.DataFrame, offset: bool = True) -> float:
    """Return the expected scatter from noise and changes of the offset, or from noise alone."""
    # The weights of deviations about a source's own mean.
    weight = 1.0 - 1.0 / rows.groupby(["source_id", "axis"])["orbit"].transform("count")
    noise = np.sqrt(np.average(rows["sigma_noise"] ** 2, weights=weight))
    return float(np.hypot(noise, within(rows, "induced") if offset else 0.0))


def ratio(rows: pd.DataFrame) -> tuple[float, float]:
    """Return measured over predicted scatter, and its jackknife error over the orbits."""

    def of(part: pd.DataFrame) -> float:
        return within(part, "deviation") / predicted(part)

    orbits = rows["orbit"].unique()
    others = np.array([of(rows[rows["orbit"] != orbit]) for orbit in orbits])
    return of(rows), float(np.sqrt((len(orbits) - 1) * others.var()))


def mean_deviation(rows: pd.DataFrame) -> tuple[float, float]:
    """Return the rms of the sources' mean deviations over the orbits, and its expectation."""
    groups = rows.groupby(["source_id", "axis"])
    variance = (rows["sigma_noise"] ** 2).groupby([rows["source_id"], rows["axis"]]).mean()
    expected = groups["induced"].mean() ** 2 + variance / groups.size()
    return rms(groups["deviation"].mean()), float(np.sqrt(expected.mean()))


def constant(rows: pd.DataFrame) -> float:
    """Return the rms of the part of the offsets that is the same in every orbit."""
    groups = rows.groupby(["source_id", "axis"])["induced"]
    return np.sqrt(max(float((groups.mean() ** 2 - groups.var() / groups.size()).mean()), 0.0))


def rms(values: pd.Series) -> float:
    """Return the root of the mean square."""
    return float(np.sqrt((values**2).mean()))


def separations(rows: pd.DataFrame) -> pd.DataFrame:
    """Return, for each source, rms and standard deviation over orbits of its distance."""
    squares = rows["deviation"] ** 2
    distance = np.sqrt(squares.groupby([rows["source_id"], rows["orbit"]]).sum())
    by_source = distance.groupby("source_id")
    return pd.DataFrame({"rms": by_source.agg(rms), "sd": by_source.std(ddof=0)})


def extent(values: pd.Series) -> str:
    """Return the 5 and 95 per cent quantiles of the values."""
    low, high = values.quantile([0.05, 0.95])
    return f"{low:.0f}-{high:.0f}"


def single_star() -> dict[str, np.ndarray]:
    """Return the closed form for one star: scatter = reported^2 / sigma_d."""
    sigma_d = SIGMA_OBS_UAS / np.sqrt(COUNTS)
    return {
        "one star alone, measured N times in an orbit, N =": np.array(COUNTS),
        "  sigma of the orbit's measurements, sigma_d": sigma_d,
        f"  reported {PAPER_REPORTED:.0f}: scatter": PAPER_REPORTED**2 / sigma_d,
        f"  scatter {PAPER_SCATTER:.0f}: reported": np.sqrt(PAPER_SCATTER * sigma_d),
    }


def figure(of: Callable[[pd.DataFrame], float], digits: int = 0) -> Callable[[pd.DataFrame], str]:
    """Return the function that formats a number computed from rows."""
    return lambda rows: f"{of(rows):.{digits}f}"


def quadratic(name: str) -> Callable[[pd.DataFrame], str]:
    """Return the function that formats the rms of a column."""
    return figure(lambda rows: rms(rows[name]))


def middle(name: str) -> Callable[[pd.DataFrame], str]:
    """Return the function that formats the median of a column."""
    return figure(lambda rows: float(rows[name].median()))


FIGURES: dict[str, Callable[[pd.DataFrame], str]] = {
    "sources": figure(lambda rows: rows["source_id"].nunique()),
    "measurements of a source in an orbit, median": middle("n_obs"),
    "prior sigma, median": middle("sigma_prior"),
    "sigma of the orbit's measurements, sigma_d, median": middle("sigma_data"),
    "reported sigma: conditional, median": middle("sigma_conditional"),
    "reported sigma, 5 to 95 % of the sources": lambda rows: extent(rows["sigma_conditional"]),
    "  largest correlation of alpha* and delta": figure(lambda rows: rows["correlation"].max(), 4),
    "marginal sigma, median": middle("sigma_marginal"),
    "marginal over conditional sigma, median": figure(
        lambda rows: float((rows["sigma_marginal"] / rows["sigma_conditional"]).median()), 4
    ),
    "share of the catalogue in the information, median": figure(
        lambda rows: float(((rows["sigma_marginal"] / rows["sigma_prior"]) ** 2).median()), 3
    ),
    "marginal sigma, rms": quadratic("sigma_marginal"),
    "  of which noise": quadratic("sigma_noise"),
    "  of which the catalogue's errors": quadratic("sigma_catalogue"),
    "  of which the calibration's priors": quadratic("sigma_calibration"),
    "deviation from the truth, rms": quadratic("deviation"),
    "scatter over orbits, noise": figure(lambda rows: predicted(rows, offset=False)),
    "scatter over orbits, noise, 5 to 95 %": lambda rows: extent(rows["sigma_noise"]),
    "  of one star alone, sigma_conditional^2 / sigma_d": figure(
        lambda rows: rms(rows["sigma_conditional"] ** 2 / rows["sigma_data"])
    ),
    "scatter over orbits, changes of the offset": figure(lambda rows: within(rows, "induced")),
    "scatter over orbits, predicted": figure(predicted),
    "scatter over orbits, measured": figure(lambda rows: within(rows, "deviation")),
    "scatter, measured over predicted": figure(lambda rows: ratio(rows)[0], 3),
    "  its sampling error": figure(lambda rows: ratio(rows)[1], 3),
    "offset from the catalogue's errors, rms": quadratic("induced"),
    "  of which the same in every orbit": figure(constant),
    "mean deviation over the orbits, rms, predicted": figure(lambda rows: mean_deviation(rows)[1]),
    "mean deviation over the orbits, rms, measured": figure(lambda rows: mean_deviation(rows)[0]),
    "rms separation from the truth (2-D), median": figure(
        lambda rows: float(separations(rows)["rms"].median())
    ),
    "rms separation (2-D), 5 to 95 %": lambda rows: extent(separations(rows)["rms"]),
    "standard deviation of the separation (2-D), median": figure(
        lambda rows: float(separations(rows)["sd"].median())
    ),
    "pull by the marginal sigma, rms": figure(
        lambda rows: rms(rows["deviation"] / rows["sigma_marginal"]), 3
    ),
    "pull of what the catalogue leaves, by noise, rms": figure(
        lambda rows: rms((rows["deviation"] - rows["induced"]) / rows["sigma_noise"]), 3
    ),
    "normalised deviation, measured": figure(lambda rows: rms(rows["normalised"]), 3),
    "normalised deviation, expected": figure(
        lambda rows: np.sqrt(1.0 - rms(rows["sigma_marginal"] / rows["sigma_prior"]) ** 2), 3
    ),
}

MEAN_FIGURES: dict[str, Callable[[pd.DataFrame], str]] = {
    "mean of all sources of an orbit: number of sources, median": middle("n"),
    "  its error if sigma_conditional averaged down, rms": quadratic("sigma_conditional"),
    "  its marginal error, rms": quadratic("sigma_marginal"),
    "  its deviation from the truth, rms over orbits": quadratic("deviation"),
    "  the catalogue's part of that deviation": quadratic("induced"),
}


def write(line: str) -> None:
    """Write one line."""
    sys.stdout.write(line + "\n")


if __name__ == "__main__":
    main()
