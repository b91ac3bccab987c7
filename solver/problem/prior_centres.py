"""Prior centres: the values of the input data plus the shifts in the settings."""

from collections.abc import Mapping

import numpy as np
import pandas as pd
from jaxtyping import Float

from solver.data.instrument import Instrument
from solver.data.parameter_group import Group
from solver.data.parameters import SOURCES
from solver.data.prior_text import split_name
from solver.data.settings import FitSettings
from solver.errors import InputError
from solver.problem.elements import Elements
from solver.problem.parameter_vector import VectorLayout


def calibration_centres(
    exposures: pd.DataFrame,
    instrument: Instrument,
    layout: VectorLayout,
    settings: FitSettings,
    elements: Elements,
) -> dict[str, Float[np.ndarray, " _"]]:
    """Return the prior centres of every calibration group, in the group's unit.

    Raises
    ------
    InputError
        If the settings shift the prior centre of an element that does not exist.
    """
    centres = {}
    # The settings give a shift of the pointing in RA as a distance on the sky.
    stretch = {"pointing_ra": 1.0 / np.cos(np.radians(exposures["dec_est"].to_numpy()))}
    for group in layout.groups:
        if group.centre_from == "environment":
            values = exposures[group.column].to_numpy(dtype=np.float64)
        elif group.centre_from == "instrument":
            values = np.array([getattr(d, group.column) for d in instrument.detectors], float)
        else:
            values = np.zeros(len(layout.columns(group)))
        names = [element.name for element in elements[group.axis]]
        shift = _shift(group, names, settings.prior_shifts)
        centres[group.name] = values * group.per_value_unit + shift * stretch.get(group.name, 1.0)
    return centres


def catalogue_shift(settings: FitSettings) -> Float[np.ndarray, " 2"]:
    """Return the shift of all sources' prior positions, (alpha*, delta), mas."""
    return _shift(SOURCES, ["ra", "dec"], settings.prior_shifts)


def _shift(
    group: Group, elements: list[str], shifts: Mapping[str, float]
) -> Float[np.ndarray, " _"]:
    """Return the shifts of a group's prior centres, in its unit."""
    total = np.zeros(len(elements))
    for name, shift in shifts.items():
        shifted, element = split_name(name)
        if shifted.name != group.name:
            continue
        if element is None:
            total += shift
        elif element in elements:
            total[elements.index(element)] += shift
        else:
            raise InputError(
                f"centre of the prior of {name}: expected an element out of "
                f"{_listed(elements)}, found {element!r}"
            )
    return total


def _listed(elements: list[str]) -> str:
    if len(elements) <= 8:
        return ", ".join(elements) or "none"
    return f"{', '.join(elements[:3])} ... {elements[-1]}"
