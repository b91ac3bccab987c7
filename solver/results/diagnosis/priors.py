"""The values of each group of calibration parameters against their prior."""

from typing import NamedTuple

import numpy as np

from solver.data.parameters import BY_NAME, PARAMETERS
from solver.data.prior_text import split_name
from solver.data.result import FitResult
from solver.results.diagnosis.rate import log_chance, of_many

# Below this share of the prior's variance that the measurements remove, they say nothing.
_LEAST_SHARE = 1e-6


class PriorRms(NamedTuple):
    """How far the values of a group are from the centre of their prior.

    A value minus the centre has the variance P - C, with P of the prior and C of the value: the
    narrower a prior, the closer to its centre it holds the value, and the less it must move it to
    be contradicted. What moves one value may move all, as a focal length that is off in every
    exposure. So the mean square counts as one value, whose chi2 has one degree of freedom.

    Attributes
    ----------
    group : of parameters
    rms : of value minus centre over its expected deviation
    log_chance : logarithm of the probability that chance makes the largest of all groups as large
    is_set : whether the settings of the fit have another prior than the default one
    """

    group: str
    rms: float
    log_chance: float
    is_set: bool

    @property
    def place(self) -> int:
        """Place of the group in `solver.data.parameters.PARAMETERS`."""
        return PARAMETERS.index(BY_NAME[self.group])


def prior_rms(result: FitResult) -> list[PriorRms]:
    """Return how far each group with a prior of finite width is from it, in table order.

    The prior of a random walk is one of its steps, and is none of these.
    """
    prior, marginal, offset = (
        result.calibration[name].to_numpy(dtype=float)
        for name in ("prior_sigma", "sigma_marginal", "offset")
    )
    known = np.isfinite(prior) & (prior > 0.0)
    # Of the prior's variance, what the measurements remove.
    removed = np.where(known, np.square(prior) - np.square(marginal), 0.0)
    is_decided = removed > _LEAST_SHARE * np.square(prior)
    squares = np.divide(np.square(offset), removed, out=np.zeros_like(offset), where=is_decided)
    means = {
        name: float(squares[rows].sum() / is_decided[rows].sum())
        for name, rows in result.group_rows.items()
        if BY_NAME[name].axis != "walk" and is_decided[rows].any()
    }
    by_hand = {*result.settings.prior_widths}
    by_hand |= {split_name(name)[0].name for name in result.settings.prior_shifts}
    return [
        PriorRms(
            name,
            float(np.sqrt(square)),
            of_many(log_chance(square, 1.0), len(means)),
            name in by_hand,
        )
        for name, square in means.items()
    ]
