"""Measurements that a robust fit leaves out together: a detector that moves, not outliers.

Where a detector moves by much, a robust fit leaves out its measurements of the stars that others
have measured, too. The stars that it alone has measured then agree with themselves at the wrong
place: no residual that is left shows it.
"""

from typing import NamedTuple

import numpy as np
import pandas as pd

from plateviz.tables.rounded import rounded
from plateviz.verdict.causes import Cause
from plateviz.verdict.remedy import remedied
from solver.data.plural import plural
from solver.data.result import FitResult
from solver.results.diagnosis.rate import log_chance_poisson, sigmas
from solver.units import RAD_PER_MAS

# Chance at which the measurements left out in one field on one detector are by accident both more
# than their share, and displaced alike. One solution has some dozens of these groups.
_LOG_CHANCE = float(np.log(1e-6))
# Where more of a group is left out than this share, no position rests on what is left.
_ALL = 0.9
_OPTION = "--detector-motion"
_GROUP = ["field_id", "detector_id"]
_EXPOSURE = ["field_id", "plate_id"]


class _Group(NamedTuple):
    """Measurements left out in one field on one detector, and their mean displacement in pixels."""

    field: int
    detector: int
    count: int
    expected: float
    shift: float
    log_chance: float


def moved_detectors(result: FitResult) -> list[Cause]:
    """Return as causes the detectors that a robust fit has left out much of, displaced alike."""
    groups = _groups(result)
    return [
        _cause(result, [one for one in groups if one.detector == detector])
        for detector in dict.fromkeys(one.detector for one in groups)
    ]


def _groups(result: FitResult) -> list[_Group]:
    """Return the groups that stand out, the most significant first."""
    out = result.outliers
    if out is None or out.empty:
        return []
    # An exposure that is bad as a whole is so on all its detectors, which then share what it loses.
    names = [*_EXPOSURE, "detector_id"]
    taken = pd.concat([result.residuals[names], out[names]]).value_counts()
    share = taken / taken.groupby(level=_EXPOSURE).transform("sum")
    lost = out.groupby(_EXPOSURE).size()
    of_exposure = pd.Index(share.index.droplevel("detector_id"))
    expected = share * lost.reindex(of_exposure, fill_value=0).to_numpy()
    expected = expected.groupby(level=_GROUP).sum()
    total = taken.groupby(level=_GROUP).sum()
    found = []
    for (field, detector), rows in out.groupby(_GROUP):
        usual = float(expected.loc[(field, detector)])
        x, y = rows["residual_x"].to_numpy(float), rows["residual_y"].to_numpy(float)
        size = np.maximum(np.hypot(x, y), np.finfo(float).tiny)
        together = float(np.hypot(np.sum(x / size), np.sum(y / size)))
        # Directions by chance add up to a square of their number (Rayleigh).
        chance = max(log_chance_poisson(len(rows), usual), -(together**2) / len(rows))
        is_all = len(rows) > _ALL * total.loc[(field, detector)]
        if chance < _LOG_CHANCE and not is_all:
            shift = float(np.hypot(np.median(x), np.median(y)))
            found.append(_Group(int(field), int(detector), len(rows), usual, shift, chance))
    return sorted(found, key=lambda one: one.log_chance)


def _cause(result: FitResult, groups: list[_Group]) -> Cause:
    detector = groups[0].detector
    fields = ", ".join(str(one.field) for one in sorted(groups))
    count, expected = sum(one.count for one in groups), sum(one.expected for one in groups)
    shift = groups[0].shift
    words = (
        f"Of the measurements left out as outliers, {count:,} are on it in "
        f"{plural(len(groups), 'field')} {fields}, where {rounded(expected)} would be its "
        f"share, and they are displaced in the same direction, by {rounded(shift, 3)} pixels."
    )
    alone = result.residuals.groupby("source_id")["detector_id"].agg(["min", "max"])
    number = int((alone == detector).all(axis=1).sum())
    spoils = (
        f"It spoils the positions of sources that this detector alone has measured, {number:,} at "
        f"most, by up to about {rounded(_on_sky(result, shift))} mas, and their "
        "residuals do not show it."
    )
    action, options = "let the detectors move from field to field in the fit", (_OPTION,)
    if remedied(result.settings, options) is None:
        action = "look at where the outliers lie, and leave this detector out"
        options = (f"--exclude detector={detector}",)
    return Cause(
        "detector-shifts",
        f"detector {detector} shifts during the orbit",
        words,
        sigmas(groups[0].log_chance),
        spoils,
        action,
        options,
        is_large=True,
    )


def _on_sky(result: FitResult, pixels: float) -> float:
    """Return the size of a displacement in pixels, mas."""
    pitch = float(result.values_of("pitch_x").mean())
    focal_length = float(result.values_of("focal_length").mean())
    return pixels * pitch / (focal_length * RAD_PER_MAS)
