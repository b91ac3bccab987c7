"""JacobianReuse: whether Jacobians of an earlier point are good enough for a step of a fit."""

from typing import NamedTuple

import numpy as np

# The Jacobians are reused while steps are at most this many sigmas long, and at most this
# fraction of the step before. Larger values fail: only the priors constrain common changes of
# pointings and detectors, and along these directions small changes of the Jacobians are
# amplified by the uncertainty.
_REUSE_BELOW = 1.0
_REUSE_RATIO = 0.1
# Tolerance of a last step with reused Jacobians, as a fraction of that with exact ones. For the
# same reason a small remainder elsewhere becomes a step along these directions that exact ones do
# not confirm.
_REUSED_TOLERANCE = 0.1
# Walking terms let pointings move against them, so that steps shrink more slowly, with exact
# Jacobians as well. Jacobians less than this many sigmas away are then as good as exact ones.
_CLOSE_WITH_WALKS = 0.01


class JacobianReuse(NamedTuple):
    """How far the Jacobians of a fit can be reused; at first, by default, they are exact.

    Attributes
    ----------
    limit : largest ratio of a step to an uncertainty that they may give; infinite if exact
    are_close : whether those of a problem with walking terms are as good as exact ones
    """

    limit: float = np.inf
    are_close: bool = False

    @classmethod
    def after(cls, largest: float, has_walks: bool) -> "JacobianReuse":
        """Return how far they can be reused after a step.

        Parameters
        ----------
        largest : largest ratio of the step to an uncertainty
        has_walks : whether the problem has walking terms
        """
        are_close = has_walks and largest < _CLOSE_WITH_WALKS
        return cls(largest if are_close else min(_REUSE_BELOW, _REUSE_RATIO * largest), are_close)

    def needs_exact(self, largest: float, tolerance: float) -> bool:
        """Return whether a step has to be computed again, from exact Jacobians.

        Parameters
        ----------
        largest : largest ratio of the step to an uncertainty
        tolerance : the fit has converged when this is below it
        """
        is_last = _REUSED_TOLERANCE < largest / tolerance < 1.0
        is_doubtful = is_last and self.limit < np.inf and not self.are_close
        return largest > self.limit or is_doubtful
