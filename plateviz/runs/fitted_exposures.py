"""Exposures of fitted orbits: a SHA-256 of the rows of each orbit, as it was fitted.

The file of all exposures changes whenever an orbit is added to the survey, so that its own SHA-256
does not tell whether those of a fitted orbit are the same.
"""

import hashlib
import json
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pandas as pd

from solver.io.atomic import write_atomically
from solver.io.failures import reading

_FILE = "exposures.json"


class FittedExposures:
    """The digests of one run, in a file of its directory; the process that fits the run writes it.

    Orbits of which nothing is recorded have none.
    """

    def __init__(self, directory: Path) -> None:
        """Read what earlier processes have recorded.

        Parameters
        ----------
        directory : of the run

        Raises
        ------
        InputError
            If the file is damaged.
        """
        self._path = directory / _FILE
        self._digests: dict[int, str] = {}
        if self._path.is_file():
            with reading(str(self._path), "digests of exposures by orbit"):
                content = json.loads(self._path.read_text(encoding="utf-8"))
                self._digests = {int(orbit): str(one) for orbit, one in content.items()}

    def of(self, orbit: int) -> str | None:
        """Return the digest of an orbit; None if nothing is recorded."""
        return self._digests.get(orbit)

    def record(self, digests: Mapping[int, str]) -> None:
        """Record digests of orbits in place of earlier ones.

        Raises
        ------
        DiskError
            If the disk is full or read-only.
        """
        merged = {**self._digests, **digests}
        if merged == self._digests:
            return
        with write_atomically(self._path) as temporary:
            temporary.write_text(json.dumps(merged), encoding="utf-8")
        self._digests = merged


def digest_of(exposures: pd.DataFrame) -> str:
    """Return the SHA-256 of the rows of one orbit, whose columns are numbers."""
    values = np.ascontiguousarray(exposures.to_numpy(np.float64))
    return hashlib.sha256(values.tobytes()).hexdigest()
