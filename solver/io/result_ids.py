"""Check that the tables of a result belong together."""

from collections.abc import Sequence
from pathlib import Path

import pandas as pd

from solver.data.plural import plural
from solver.data.result import FitResult
from solver.errors import InputError
from solver.io import published_layout as layout

_MOST_LISTED = 5


def check_ids(path: Path, result: FitResult) -> None:
    """Check that the residuals are of sources, exposures and detectors of the result.

    Whoever edits one table of a file may forget another; a neighbour would be taken for what is
    missing.

    Parameters
    ----------
    path : of the result, for the message

    Raises
    ------
    InputError
        If a residual is of another one, or there is no residual.
    """
    found = result.residuals
    if found.empty:
        raise InputError(
            f"{path}, HDU {layout.SAMPLE.hdu}: expected a residual of each measurement, "
            "found no row"
        )
    _check(path, found, result.sources, ["source_id"], f"HDU {layout.RESULT.hdu}")
    exposure = ["field_id", "plate_id"]
    _check(path, found, result.exposures, exposure, f"HDU {layout.EXPOSURES.hdu}")
    if result.instrument is not None:
        detectors = pd.DataFrame({"detector_id": result.instrument.detector_ids})
        _check(path, found, detectors, ["detector_id"], "the instrument of the fit")


def _check(
    path: Path, found: pd.DataFrame, known: pd.DataFrame, names: Sequence[str], where: str
) -> None:
    named, ids = (
        pd.MultiIndex.from_frame(table[list(names)].drop_duplicates()) for table in (found, known)
    )
    missing = [one if len(names) > 1 else one[0] for one in sorted(named.difference(ids))]
    if missing:
        listed = ", ".join(str(one) for one in missing[:_MOST_LISTED])
        more = len(missing) - _MOST_LISTED
        raise InputError(
            f"{path}, HDU {layout.SAMPLE.hdu}, {plural(len(names), 'column')} "
            f"{' and '.join(names)}: expected ids of {where}, found {len(missing):,} that it "
            f"does not have: {listed}{f' and {more:,} more' if more > 0 else ''}"
        )
