"""FitResult: tables and summary of one fitted orbit. Neither JAX nor files are used here."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import Enum
from functools import cached_property
from typing import Any

import numpy as np
import pandas as pd

from solver.data.instrument import Instrument
from solver.data.parameter_group import Axis, Group
from solver.data.parameters import PARAMETERS
from solver.data.places import places_among
from solver.data.settings import FitSettings


class FitStatus(Enum):
    """How a fit ended; the value is the message to show."""

    CONVERGED = "every step of the last iteration is below the tolerance times its uncertainty"
    WHAT_IF = "a step from another fit by its linearised model, which a refit would confirm"
    MAX_ITERATIONS = "the limit of iterations was reached before the steps became small"
    STUCK = "no part of the step made chi2 fall any further, and the steps are not small"
    AT_REST = "the loss has come to rest, and the linearised problem puts the mode there"
    SAMPLED = "the chains agree with each other, and none of their steps diverged"
    UNMIXED = "the chains do not agree with each other yet, or some of their steps diverged"
    STALLED = "the loss has come to rest, but the linearised problem puts the mode elsewhere"
    MAX_STEPS = "the limit of steps was reached before the loss came to rest"
    SINGULAR = "the data and the priors together leave a direction of the solution open"
    NOT_FINITE = "the residuals are not finite: a start value is far from the truth"

    @property
    def is_solution(self) -> bool:
        """Whether the engine reached a solution."""
        return self in _SOLUTIONS


_SOLUTIONS = (
    FitStatus.CONVERGED,
    FitStatus.WHAT_IF,
    FitStatus.AT_REST,
    FitStatus.SAMPLED,
)


@dataclass(frozen=True, repr=False)
class FitResult:
    """One fitted orbit; columns and units as in `solver.data.schema`.

    Attributes
    ----------
    sources : `schema.SOURCES`, in ascending source_id
    residuals : `schema.RESIDUALS`, in the row order of the measurements read
    calibration : `schema.CALIBRATION`, every parameter group except the sources
    exposures : `schema.EXPOSURES`, in order of (field_id, plate_id)
    trace : `schema.TRACE`
    summary : plain numbers and text; keys as in `solver.results.summary`
    settings : settings of the fit
    provenance : file name -> SHA-256 of the inputs
    instrument : nominal focal plane of the fit; None in a result of an older version without it
    true_places : `schema.TRUE_PLACES`, or None if there is no truth
    outliers : `schema.OUTLIERS`, or None if the fit was not robust
    orders : `schema.ORDERS`, or None if orders were not compared
    losses : `schema.LOSSES`, or None if the engine has no loss
    eigenmodes, mode_parameters, mode_shifts : the eigenmodes, and the parameters and sources that
        the weak ones move, as in `solver.data.eigenmode_schema`; None in a result of an older
        version without them
    derived : what was computed from the result and is kept with it, by name; written nowhere
    """

    sources: pd.DataFrame
    residuals: pd.DataFrame
    calibration: pd.DataFrame
    exposures: pd.DataFrame
    trace: pd.DataFrame
    summary: Mapping[str, Any]
    settings: FitSettings
    provenance: Mapping[str, str] = field(default_factory=dict)
    instrument: Instrument | None = None
    true_places: pd.DataFrame | None = None
    losses: pd.DataFrame | None = None
    outliers: pd.DataFrame | None = None
    eigenmodes: pd.DataFrame | None = None
    mode_parameters: pd.DataFrame | None = None
    mode_shifts: pd.DataFrame | None = None
    orders: pd.DataFrame | None = None
    derived: dict[str, Any] = field(default_factory=dict, init=False, compare=False)

    def __repr__(self) -> str:
        """Return a short text: a widget makes it of every solution that it offers."""
        return f"<FitResult of orbit {self.orbit_id}: {self.settings.describe()}>"

    @property
    def orbit_id(self) -> int:
        """The `orbit_id` of the fitted orbit."""
        return int(self.exposures["orbit_id"].iloc[0])

    @cached_property
    def exposure_index(self) -> np.ndarray:
        """The row of `exposures` that each residual belongs to, shape (n,)."""
        known, values = (
            [table[name].to_numpy() for name in ("field_id", "plate_id")]
            for table in (self.exposures, self.residuals)
        )
        return places_among(known, values)

    @cached_property
    def group_rows(self) -> Mapping[str, np.ndarray]:
        """The rows of `calibration` of each parameter group, by its name, in table order."""
        number, names = pd.factorize(self.calibration["group"])
        return {str(name): np.flatnonzero(number == n) for n, name in enumerate(names)}

    def groups_on(self, axis: Axis) -> tuple[Group, ...]:
        """Return the parameter groups of the fit with one value per element of `axis`."""
        return tuple(g for g in PARAMETERS if g.axis == axis and g.name in self.group_rows)

    def labels_on(self, axis: Axis) -> pd.Series:
        """Return the words of each element of an axis; those of groups that differ, together."""
        is_here = self.calibration["group"].isin([group.name for group in self.groups_on(axis)])
        labels = self.calibration[is_here].groupby("element")["label"]
        return labels.agg(lambda names: " ".join(dict.fromkeys(names)))

    def values_of(self, group: str, column: str = "value") -> np.ndarray:
        """Return one column of `calibration` for a parameter group, in the order of its elements.

        Raises
        ------
        KeyError
            If the fit does not have the group.
        """
        return self.calibration[column].to_numpy()[self.group_rows[group]]

    def values_on(self, axis: Axis, column: str = "value") -> pd.DataFrame:
        """Return one column of `calibration` as a wide table.

        Parameters
        ----------
        axis : an axis of the calibration, such as "exp", "det" or "coef"
        column : a column of numbers of `schema.CALIBRATION`

        Returns
        -------
        One row per element of the axis, in order, and one column per group on the axis.
        """
        names = [group.name for group in self.groups_on(axis)]
        of_group = [self.group_rows[name] for name in names]
        here = np.concatenate([np.empty(0, dtype=np.intp), *of_group])
        element, values = (self.calibration[one].to_numpy()[here] for one in ("element", column))
        rows, row = np.unique(element, return_inverse=True)
        # Filled in one go; to pivot, or to align series, would take several times as long.
        wide = np.full((len(rows), len(names)), np.nan)
        wide[row, np.repeat(np.arange(len(names)), [len(one) for one in of_group])] = values
        index, columns = pd.Index(rows, name="element"), pd.Index(names, name="group")
        return pd.DataFrame(wide, index, columns)
