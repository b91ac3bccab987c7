"""Measure the verdict: its false alarms, and from which size on it sees and names each defect.

    python tests/campaigns/verdicts.py [--trials N] [--records FILE] [--write assets/docs]
    python tests/campaigns/verdicts.py --carry-over VERSION [--sample N] [--records FILE]

Sparse orbits of some 1,300 sources are simulated without and with each defect that one orbit can
show, at five amplitudes, and fitted with the default settings; and at the largest with its cause
modelled. A defect that takes more reference stars is put into full orbits, too. Each trial takes
two to four seconds of a core, all of them three hours. Trials are recorded with the version of the
verdict; a stopped campaign goes on, and runs those of other versions again. The second form instead
repeats a sample of the trials of another version, and marks its records with the present one, but
for those of cases of which a trial has another verdict now.
"""

import argparse
import sys
import time
from pathlib import Path

# Import this checkout, whatever the working directory.
sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

# Imported before NumPy, as in the program, because it sets how long idle BLAS threads spin.
import solver  # noqa: F401, I001

import numpy as np

from plateviz.verdict.verdict import orbit_verdict
from solver.data.result import FitResult
from solver.data.settings import FitSettings
from solver.errors import FitError, InputError
from solver.fit import fit_orbit
from tests.benchmarks.machine import write
from tests.campaigns.carried import carry_over
from tests.campaigns.defects import applied_defect, pulls
from tests.campaigns.trials import Record, read_records, run_trials
from tests.campaigns.true_causes import all_deviations
from tests.campaigns.verdict_cases import Trial, numbers, trial_of
from tests.campaigns.verdict_page import IMPOSSIBLE, write_page
from tests.campaigns.verdict_version import verdict_version


def main() -> int:
    arguments = parse_arguments()
    version = verdict_version()
    if arguments.carry_over:
        return carry(arguments.records, arguments.carry_over, version, arguments.sample)
    chosen = numbers()[: arguments.trials]
    run_trials(arguments.records, chosen, trial, after=report, version=version)
    if arguments.write:
        write_page(arguments.write, read_records(arguments.records, version))
    return 0


def carry(records: Path, before: str, version: str, count: int) -> int:
    """Carry the records of a version over to the present one, and say which trials differ."""
    try:
        found = carry_over(records, trial, before, version, count)
    except ValueError as error:
        write(str(error))
        return 2
    write(f"{found.records} records are carried over.")
    if found.different:
        write("Not those of the cases of these trials, whose verdicts differ:")
    for line in found.different:
        write(line)
    return 1 if found.different else 0


def trial(number: int) -> Record:
    """Return the verdict of the trial of a number, as `record_of`."""
    return record_of(trial_of(number))


def record_of(wanted: Trial) -> Record:
    """Return the verdict of a trial, and the rms pull of the sources with many measurements."""
    case, start = wanted.case, time.process_time()
    settings = FitSettings(**case.modelled) if case and wanted.is_modelled else FitSettings()
    try:
        orbit = wanted.simulated()
    except InputError as error:
        return {"state": IMPOSSIBLE, "causes": [], "failed": str(error)}
    try:
        result = fit_orbit(orbit, settings=settings)
    except (FitError, InputError) as error:
        return {"state": "none", "causes": [], "failed": str(error)}
    verdict = orbit_verdict(result)
    found = pulls(result.sources, result.true_places)
    record = {
        "state": verdict.state,
        "causes": [cause.name for cause in verdict.causes if not cause.instead_of],
        "sigma": round(float(verdict.causes[0].significance), 1) if verdict.causes else 0.0,
        "converged": bool(result.summary["converged"]),
        "pull": round(float(np.sqrt(np.mean(found**2))), 4),
        "sources": len(result.sources),
    }
    if wanted.is_modelled:
        record |= of_truth(wanted, result)
    return {**record, "seconds": round(time.process_time() - start, 2)}


def of_truth(wanted: Trial, result: FitResult) -> dict[str, float | int]:
    """Return the rms deviation of the new parameters from the truth, sigmas, and their number."""
    case = wanted.case
    if case is None:
        return {}
    defect = applied_defect(case.name, case.at(wanted.factor), wanted.orbit)
    found = all_deviations(defect, result)
    if not found:
        return {}
    together = np.concatenate(list(found.values()))
    return {
        "deviation": round(float(np.sqrt(np.mean(together**2))), 3),
        "parameters": together.size,
    }


def report(number: int, record: Record) -> None:
    """Print one line about a trial."""
    wanted = trial_of(number)
    what = f"{wanted.case.text(wanted.factor)}" if wanted.case else "clean"
    words = " modelled" if wanted.is_modelled else ""
    write(f"{number}: {what}{words}: {record}")


def parse_arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description="Measure the verdict.")
    parser.add_argument("--trials", type=int, help="the first so many, all by default")
    parser.add_argument("--records", type=Path, default=Path("verdicts.jsonl"))
    parser.add_argument(
        "--carry-over", metavar="VERSION", help="mark its records with the present version"
    )
    parser.add_argument("--sample", type=int, default=160, help="trials repeated before that")
    parser.add_argument("--write", type=Path, help="folder of verdicts.md and its figure")
    return parser.parse_args()


if __name__ == "__main__":
    sys.exit(main())
