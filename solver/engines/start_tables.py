"""StartTables: the tables of a solution, from which a fit of the same orbit can start."""

from typing import NamedTuple

import numpy as np
import pandas as pd

from solver.engines.gauss_newton import StartingPoint
from solver.problem.problem import Problem


class StartTables(NamedTuple):
    """The offsets of a solution from the centres of its priors.

    Attributes
    ----------
    calibration : columns group and offset of `schema.CALIBRATION`
    sources : columns source_id, offset_ra and offset_dec of `schema.SOURCES`
    """

    calibration: pd.DataFrame
    sources: pd.DataFrame

    def point(self, problem: Problem) -> StartingPoint | None:
        """Return the solution as a point of a problem; None if the problem has other parameters.

        The priors of both have to have the same centres, or the point is far from the solution.
        """
        layout, sources = problem.layout, self.sources[["offset_ra", "offset_dec"]].to_numpy(float)
        offsets = self.calibration.groupby("group", sort=False)["offset"]
        groups = {str(name): rows.to_numpy(float) for name, rows in offsets}
        theta = np.full(layout.size, np.nan)
        for group in layout.groups:
            columns, found = layout.columns(group), groups.pop(group.name, np.empty(0))
            if len(found) != len(columns):
                return None
            theta[columns] = found
        ids = problem.sources["source_id"].to_numpy()
        is_of_it = not groups and np.array_equal(self.sources["source_id"].to_numpy(), ids)
        is_finite = np.isfinite(theta).all() and np.isfinite(sources).all()
        return StartingPoint(theta, sources) if is_of_it and is_finite else None
