"""Elements: the elements of every calibration axis of an orbit under given settings, in order."""

from typing import NamedTuple

import numpy as np
import pandas as pd
from jaxtyping import Int

from solver.data.detector_spans import span_numbers
from solver.data.distortion_terms import terms
from solver.data.instrument import Instrument
from solver.data.parameter_group import Axis
from solver.data.settings import FitSettings
from solver.problem.optional_terms import optional_terms


class Element(NamedTuple):
    """One element of an axis: its name in settings, and its words in labels.

    The words of a distortion term follow the letter of its direction, "A" or "B".
    """

    name: str
    words: str


Elements = dict[Axis, list[Element]]


def elements(exposures: pd.DataFrame, instrument: Instrument, settings: FitSettings) -> Elements:
    """Return the elements of all axes; an axis that the fit has no groups on has none.

    Parameters
    ----------
    exposures : in order of (field_id, plate_id)
    """
    plates = list(zip(exposures["field_id"], exposures["plate_id"], strict=True))
    detectors = [str(detector.detector_id) for detector in instrument.detectors]
    later = [str(field) for field in np.unique(exposures["field_id"])[1:]]
    times = [Element(f"t{k}", "t" if k == 1 else f"t^{k}") for k in _degrees(settings)]
    exposures_called = [
        Element(f"{field}/{plate}", f"field {field} plate {plate}") for field, plate in plates
    ]
    phases = [Element("cos", "cos"), Element("sin", "sin")]
    moved = _spans(exposures)[1:] if settings.detector_motion else []
    functions: Elements = {
        "drift": times,
        "breathing": phases,
        "field": _called("field", later),
        "own": _called("detector", detectors),
    }
    return {
        "exp": exposures_called,
        "coef": _terms(settings.order),
        **dict.fromkeys(functions, []),
        **{one.axis: _products(one.order, functions[one.axis]) for one in optional_terms(settings)},
        # Only terms that the distortion has can walk.
        "walk": _products(min(settings.drift_walk, settings.order), exposures_called),
        "det": _called("detector", detectors),
        "motion": [
            Element(f"{detector}/{span.name}", f"detector {detector} {span.words}")
            for detector in detectors
            for span in moved
        ],
    }


def field_numbers(exposures: pd.DataFrame) -> Int[np.ndarray, " exp"]:
    """Return the number of the field of each exposure, from 0."""
    return np.unique(exposures["field_id"].to_numpy(), return_inverse=True)[1]


def _spans(exposures: pd.DataFrame) -> list[Element]:
    """Return the spans: a field, and in it what follows a move, by its first exposure."""
    first = exposures.assign(span=span_numbers(exposures)).sort_values(["span", "obstime"])
    first = first.drop_duplicates("span")
    begins = ~first["field_id"].duplicated()
    rows = zip(first["field_id"], first["plate_id"], begins, strict=True)
    return [
        Element(f"{field}", f"field {field}")
        if is_first
        else Element(f"{field}/{plate}", f"field {field} from plate {plate}")
        for field, plate, is_first in rows
    ]


def _degrees(settings: FitSettings) -> range:
    return range(1, settings.drift_in_time + 1)


def _terms(order: int) -> list[Element]:
    return [Element(f"{k}/{j}", f"({k},{j})") for k, j in terms(order)]


def _called(word: str, names: list[str]) -> list[Element]:
    return [Element(name, f"{word} {name}") for name in names]


def _products(order: int, functions: list[Element]) -> list[Element]:
    """Return the terms of each function: those of a function are adjacent."""
    return [
        Element(f"{term.name}/{function.name}", f"{term.words} {function.words}")
        for function in functions
        for term in _terms(order)
    ]
