"""Which of the causes found are named: the first one, and those that it has not brought about."""

from typing import NamedTuple

import numpy as np

from solver.results.diagnosis.contradictions import STARS, beyond_shift, is_beyond_noise
from solver.results.diagnosis.found import CLOSE, Found, limit_of
from solver.results.diagnosis.pattern_causes import LEAST_SHARE, PATTERNS
from solver.results.diagnosis.scatter_causes import OF_GROUPS, SCATTER
from solver.results.diagnosis.table import Diagnosis

# Patterns that each exposure may have of its own.
OF_EXPOSURES = ("stretch", "shear", "quadratic")
# Single measurements that are wrong.
FAR_OFF = ("outliers", "swapped")
# The positions of the sources carry these into all exposures.
_MAKES_PATTERNS = ("swing", *FAR_OFF, *STARS, "epoch", "prior", *OF_EXPOSURES)
# A cause of another kind is named beside the first one from this share of its sigmas.
_OF_ITS_OWN = 0.5
# What these bring about explains at most so many times what the positions carry.
_SHIFTS_STARS, _MARGIN = ("swing", "outliers"), 2.0


class NamedCauses(NamedTuple):
    """The causes found, divided.

    Attributes
    ----------
    named : the first one, and those that it has not brought about
    left_out : those that it may have brought about
    """

    named: list[Found]
    left_out: list[Found]

    def rivals(self) -> list[Found]:
        """Return the causes that are left out, but nearly as likely as the first one.

        What describes the size of the residuals includes a noise that is larger as a whole.
        """
        return [
            one
            for one in self.left_out
            if one.gain > self.named[0].gain - CLOSE
            and one.test.subject not in (*SCATTER, "kurtosis")
        ]


def named_causes(found: list[Found], diagnosis: Diagnosis) -> NamedCauses:
    """Return the causes without those that the first one may have brought about, and these.

    Patterns were tested one after the other. Of two kinds of causes the weaker may be a result of
    the stronger; the next fit finds it if it is not.

    Parameters
    ----------
    found : the likeliest first; may be empty
    """
    if not found:
        return NamedCauses([], [])
    first, *others = found
    named, left_out = [first], list[Found]()
    shift = _shift_by_patterns(found, diagnosis)
    for one in others:
        rest = _beyond_patterns(one, first, diagnosis, shift)
        its_own = [each for each in rest if _is_its_own(each, first, diagnosis)]
        named += its_own
        if not its_own:
            left_out.append(one)
    return NamedCauses(named, left_out)


def _shift_by_patterns(found: list[Found], diagnosis: Diagnosis) -> float:
    """Return by how much the patterns together shift the stars, rms along each axis, mas."""
    sizes = [one.test.size_um for one in found if one.test.subject in PATTERNS]
    return diagnosis.camera.on_sky(float(np.hypot.reduce(sizes))) if sizes else 0.0


def _beyond_patterns(one: Found, first: Found, diagnosis: Diagnosis, shift: float) -> list[Found]:
    """Return what is left of a cause if patterns, where they come first, shift the stars.

    Parameters
    ----------
    shift : of the positions by the patterns, rms along each axis, mas
    """
    if first.test.subject in PATTERNS and one.test.subject in (*STARS, "epoch"):
        return beyond_shift(diagnosis, one, shift)
    return [one]


def _is_its_own(one: Found, first: Found, diagnosis: Diagnosis) -> bool:
    """Return whether the first cause has not brought about another one."""
    subject, leads = one.test.subject, first.test.subject
    if subject in PATTERNS and leads in PATTERNS:
        return True
    if subject == "epoch":
        # No other cause moves each star along its own proper motion.
        return True
    if subject == "prior" and leads in SCATTER:
        return is_beyond_noise(one, diagnosis.scale, limit_of(diagnosis))
    if subject == "sources" and leads in FAR_OFF:
        return False
    is_weak = one.test.sigma <= _OF_ITS_OWN * first.test.sigma
    if is_weak or _is_of_tails(subject, leads):
        return False
    if subject in PATTERNS and leads in _SHIFTS_STARS:
        return one.gain > _carried(first, diagnosis)
    if subject in PATTERNS and leads in _MAKES_PATTERNS:
        return False
    return one.gain > LEAST_SHARE * first.gain


def _carried(first: Found, diagnosis: Diagnosis) -> float:
    """Return the largest gain of a pattern that wrong measurements bring about elsewhere.

    One wrong of n measurements shifts its star by 1/n; its other residuals have 1/n of the chi2.
    """
    rows = diagnosis.rows
    return _MARGIN * first.gain * len(np.unique(rows.source)) / max(rows.n, 1)


def _is_of_tails(subject: str, leads: str) -> bool:
    """Return whether a cause is not to be named beside the first one because of tails.

    Whatever spoils some residuals more than others gives all of them tails, and noise with tails
    makes groups scatter; but it does not change their size as a whole.
    """
    return subject == "kurtosis" or (leads == "kurtosis" and subject in OF_GROUPS)
