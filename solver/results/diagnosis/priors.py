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
    rows = result.calibration
    prior = rows["prior_sigma"] ** 2
    # Of the prior's variance, what the measurements remove.
    share = 1.0 - rows["sigma_marginal"] ** 2 / prior
    is_decided = np.isfinite(prior) & (prior > 0.0) & (share > _LEAST_SHARE)
    rows, expected = rows[is_decided], (share * prior)[is_decided]
    means = (rows["offset"] ** 2 / expected).groupby(rows["group"], sort=False).mean()
    means = means[[BY_NAME[str(name)].axis != "walk" for name in means.index]]
    by_hand = {*result.settings.prior_widths}
    by_hand |= {split_name(name)[0].name for name in result.settings.prior_shifts}
    return [
        PriorRms(
            str(name),
            float(np.sqrt(square)),
            of_many(log_chance(float(square), 1.0), len(means)),
            name in by_hand,
        )
        for name, square in means.items()
    ]
