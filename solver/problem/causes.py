"""Inputs of the optional parameter groups: functions of time, field and detector as arrays."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pandas as pd
from jaxtyping import Float

from solver.data.detector_spans import motion_elements, span_numbers
from solver.data.instrument import Instrument
from solver.data.magnitudes import faintness
from solver.data.settings import FitSettings
from solver.errors import InputError
from solver.model.causes import ModelledCauses, TermFamily
from solver.problem.optional_terms import optional_terms
from solver.problem.padding import pad
from solver.problem.term_factors import changing_terms, own_frames


def causes_of(
    exposures: pd.DataFrame, sources: pd.DataFrame, instrument: Instrument, settings: FitSettings
) -> ModelledCauses | None:
    """Return the inputs of the causes that the settings include, or None if they include none.

    Raises
    ------
    InputError
        If no source has a magnitude and the settings need it.
    """
    if not settings.optional_groups:
        return None
    span, n_det = span_numbers(exposures), len(instrument.detectors)
    moves = np.repeat((span > 0).astype(float)[:, None], n_det, axis=1)
    return ModelledCauses(
        families=_families(exposures, instrument, settings),
        element=motion_elements(span, np.arange(len(span))[:, None], np.arange(n_det)),
        moves=moves,
        faintness=_faintness(sources, settings),
        pixels=np.array([(d.n_x, d.n_y) for d in instrument.detectors], dtype=float),
    )


def _families(
    exposures: pd.DataFrame, instrument: Instrument, settings: FitSettings
) -> tuple[TermFamily, ...]:
    """Return the families in the order of `parameter_group.TERM_AXES`."""
    n_exp, n_det = len(exposures), len(instrument.detectors)
    centre, scale = np.zeros((n_det, 2)), np.full(n_det, instrument.distortion_scale_um)
    found = []
    changing = dict(changing_terms(exposures, settings))
    for terms in optional_terms(settings):
        if terms in changing:
            of_all = np.repeat(changing[terms][:, :, None], n_det, axis=2)
            found.append(TermFamily(terms.name, terms.order, of_all, centre, scale))
        else:
            own = np.repeat(np.eye(n_det)[:, None], n_exp, axis=1)
            found.append(TermFamily(terms.name, terms.order, own, *own_frames(instrument)))
    return tuple(found)


def _faintness(sources: pd.DataFrame, settings: FitSettings) -> Float[np.ndarray, " src"]:
    """Return flux^(-1/2) of the sources, zero without a magnitude."""
    if not (settings.magnitude_shift or settings.charge_transfer):
        return np.zeros(len(sources))
    magnitude = (
        sources["magnitude"].to_numpy(dtype=float) if "magnitude" in sources else np.array([])
    )
    if not np.isfinite(magnitude).any():
        raise InputError(
            "charge transfer and shifts by magnitude: expected magnitudes in the catalogue, found "
            "none"
        )
    return faintness(magnitude)


def padded(causes: ModelledCauses, sizes: Mapping[str, int]) -> ModelledCauses:
    """Return the inputs of the causes padded along exp and src."""
    families = (
        replace(family, factor=pad(family.factor.swapaxes(0, 1), "exp", sizes).swapaxes(0, 1))
        for family in causes.families
    )
    return replace(
        causes,
        families=tuple(families),
        element=pad(causes.element, "exp", sizes),
        moves=pad(causes.moves, "exp", sizes),
        faintness=pad(causes.faintness, "src", sizes),
    )
