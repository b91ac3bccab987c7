"""Check the uncertainties of fits against orbits drawn from the priors.

    python tests/campaigns/calibration.py [--few 200] [--many 50] [--records FILE]

Each orbit has all its parameters drawn from the priors of the fit (`prior_draws.py`) and is fitted
with the default settings: 9 to 60 reference stars in the orbits with few, 300 to 1,500 in those
with many. The pulls of the sources and of every calibration group are compared with a normal
distribution (`coverage.py`): rms, coverage, and ranks of the truth in the posterior
(simulation-based calibration).

The exit code is 1 if a group's rms pull with the marginal sigma differs from one by more than
0.02, or its coverage by more than 1 %, and by more than three standard errors. The pointings of an
orbit share their error, and so do the elements of most groups of the calibration: an orbit then
counts little more than one draw, and the standard error says what the orbits can tell.
"""

import argparse
import sys
import time
from collections.abc import Sequence
from pathlib import Path

# Import this checkout, whatever the working directory.
sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

# Imported before NumPy, as in the program, because it sets how long idle BLAS threads spin.
import solver  # noqa: F401, I001

import numpy as np

from solver.errors import FitError, InputError
from solver.fit import fit_orbit
from tests.benchmarks.machine import write
from tests.campaigns.coverage import Sums, failures, markdown, rank_table, sums_of, table
from tests.campaigns.prior_draws import Size, draw_orbit
from tests.campaigns.trials import Record, run_trials

RMS_TOLERANCE, COVERAGE_TOLERANCE = 0.02, 0.01
# Trials from this number on have many references.
FIRST_MANY = 1_000_000
EXPOSURES_PER_FIELD = (4, 12, 24)


def main() -> int:
    arguments = parse_arguments()
    sets = {
        "few": range(arguments.first, arguments.first + arguments.few),
        "many": range(FIRST_MANY, FIRST_MANY + arguments.many),
    }
    off = []
    for name, numbers in sets.items():
        if not len(numbers):
            continue
        records = run_trials(arguments.records, numbers, trial, after=report)
        off += report_set(name, records)
    write("\n".join(off) or "no figure is off by more than its tolerance and three standard errors")
    return int(bool(off))


def trial(number: int) -> Record:
    """Draw and fit one orbit, and return its sums by group."""
    begin = time.perf_counter()
    orbit = draw_orbit(number, size_of(number))
    drawn = time.perf_counter()
    try:
        result = fit_orbit(orbit.data, orbit.instrument)
    except (FitError, InputError) as error:
        return {"failed": str(error)}
    summary = result.summary
    record = {
        "references": int(summary["n_reference"]),
        "sources": int(summary["n_sources"]),
        "exposures": len(result.exposures),
        "iterations": int(summary["iterations"]),
        "seconds": [round(t, 2) for t in (drawn - begin, time.perf_counter() - drawn)],
    }
    if not summary["converged"]:
        return {"failed": str(summary["reason"]), **record}
    return {**record, "groups": sums_of(result, orbit.truth)}


def size_of(number: int) -> Size:
    """Return the size of the orbit of a trial."""
    rng = np.random.default_rng([number, 1])
    low, high = (300, 1500) if number >= FIRST_MANY else (10, 60)
    return Size(
        references=int(rng.integers(low, high + 1)),
        others=int(rng.integers(200, 1501)),
        exposures_per_field=int(rng.choice(EXPOSURES_PER_FIELD)),
    )


def report(number: int, record: Record) -> None:
    """Print one line about a trial."""
    groups = record.get("groups")
    rms = {
        name: np.sqrt(sums["marginal"]["squares"] / sums["n"])
        for name, sums in (groups or {}).items()
        if sums["n"]
    }
    figures = ", ".join(f"{value:.2f}" for value in rms.values())
    facts = {name: value for name, value in record.items() if name != "groups"}
    write(f"{number}: {facts} {figures}")


def report_set(name: str, records: Sequence[Record]) -> list[str]:
    """Print the table of a set of orbits, and return which of its figures are off, in words."""
    failed = [str(record["failed"]) for record in records if "failed" in record]
    groups: list[dict[str, Sums]] = [record["groups"] for record in records if "groups" in record]
    references = [record["references"] for record in records if "groups" in record]
    if not groups:
        return [f"{name}: no orbit was solved: {reason}" for reason in sorted(set(failed))]
    write(
        f"\n## {name} references: {len(groups)} orbits with {min(references)} to "
        f"{max(references)}, {len(failed)} without a solution\n"
    )
    write(markdown(table(groups)))
    write("\nRanks of the truth: share of each tenth of the posterior that begins at, per cent\n")
    write(markdown(rank_table(groups)) + "\n")
    found = [f"{name}, no solution: {reason}" for reason in failed]
    return found + [f"{name}, {one}" for one in failures(groups, RMS_TOLERANCE, COVERAGE_TOLERANCE)]


def parse_arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description="Check the uncertainties of fits.")
    parser.add_argument("--few", type=int, default=200, help="orbits with 10 to 60 references")
    parser.add_argument("--many", type=int, default=50, help="orbits with 300 to 1500 references")
    parser.add_argument("--first", type=int, default=0, help="first seed of those with few")
    parser.add_argument("--records", type=Path, default=Path("calibration.jsonl"))
    return parser.parse_args()


if __name__ == "__main__":
    sys.exit(main())
