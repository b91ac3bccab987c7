"""The source of a run whose motion differs most significantly from its catalogue."""

from typing import NamedTuple

import numpy as np
import pandas as pd

from plateviz.tables.counts import orbits_text
from plateviz.tables.rounded import with_minus_signs

_MOTION = ("parallax", "pmra", "pmdec")


class NotableSource(NamedTuple):
    """A source and what the orbits add to its catalogue.

    Attributes
    ----------
    source_id : of the source
    n_orbits : orbits that measured it
    proper_motion : size of the fitted minus the catalogue's proper motion, mas/yr
    parallax : fitted minus catalogue's parallax, mas
    """

    source_id: int
    n_orbits: int
    proper_motion: float
    parallax: float

    @property
    def text(self) -> str:
        """What is notable about it, in one line."""
        parallax = with_minus_signs(f"{self.parallax:+.2f}")
        return (
            f"{self.proper_motion:.2f} mas/yr and {parallax} mas parallax off its catalogue, in "
            f"{orbits_text(self.n_orbits)}"
        )


def notable_source(motions: pd.DataFrame) -> NotableSource | None:
    """Return the source with the most significant departure from its catalogue.

    The significance is the root of the sum of squares of parallax and both proper motions,
    fitted minus catalogue, over their uncertainties.

    Parameters
    ----------
    motions : `survey_schema.MOTIONS`

    Returns
    -------
    None if no motion was fitted with degrees of freedom left
    """
    fitted = motions[motions["dof"] > 0]
    significance = sum(((fitted[f"fit_{p}"] / fitted[f"sigma_{p}"]) ** 2 for p in _MOTION), 0.0)
    significance = np.sqrt(pd.Series(significance, index=fitted.index)).dropna()
    if significance.empty:
        return None
    row = fitted.loc[significance.idxmax()]
    proper_motion = float(np.hypot(row["fit_pmra"], row["fit_pmdec"]))
    return NotableSource(
        int(row["source_id"]), int(row["n_orbits"]), proper_motion, float(row["fit_parallax"])
    )
