"""Measure the verdict at amplitudes and seeds that are not those of its page.

    python tests/campaigns/other_orbits.py [--orbits 20] [--factor 1.4] [--first 5000]

Nothing of the verdict was chosen by these orbits: what is seen and named has to be between what the
page shows at the amplitudes beside. Two to six seconds of a core for each orbit.
"""

import argparse
import sys
from pathlib import Path

# Import this checkout, whatever the working directory.
sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

# Imported before NumPy, as in the program, because it sets how long idle BLAS threads spin.
import solver  # noqa: F401, I001

from tests.benchmarks.machine import write
from tests.campaigns.verdict_cases import CASES, Trial
from tests.campaigns.verdict_demands import named, rms_pull, seen
from tests.campaigns.verdicts import record_of


def main() -> int:
    arguments = parse_arguments()
    orbits = range(arguments.first, arguments.first + arguments.orbits)
    clean = [record_of(Trial(None, 0.0, False, orbit)) for orbit in orbits]
    write(f"clean orbits: {len(clean) - sum(seen(clean))} of {len(clean)} called good\n")
    write(f"| defect | × {arguments.factor:g} | rms pull | orbits | seen | named rightly |")
    write("|---|---:|---:|---:|---:|---:|")
    cases = [case for case in CASES if arguments.only in (None, case.name)]
    for case in cases:
        trials = [Trial(case, arguments.factor, False, orbit) for orbit in orbits]
        records = [record_of(trial) for trial in trials]
        right = sum(named(case, records))
        write(
            f"| {case.title} | {case.words(arguments.factor)} |"
            f" {rms_pull(records):.3f} | {len(records)} | {sum(seen(records))} | {right} |"
        )
    return 0


def parse_arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--orbits", type=int, default=20, help="of each defect")
    parser.add_argument("--factor", type=float, default=1.4, help="of the amplitude of the page")
    parser.add_argument("--first", type=int, default=5000, help="seed of the first orbit")
    parser.add_argument("--only", help="name of one defect; all by default")
    return parser.parse_args()


if __name__ == "__main__":
    sys.exit(main())
