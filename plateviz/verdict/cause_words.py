"""What is said of each kind of cause: its name, the evidence, and what to do."""

from collections.abc import Callable

from plateviz.tables.rounded import rounded
from plateviz.verdict.cause_case import Case, Said
from plateviz.verdict.data_cause_words import (
    said_of_epoch,
    said_of_kurtosis,
    said_of_noise,
    said_of_noise_of,
    said_of_other,
    said_of_others,
    said_of_outliers,
    said_of_reference,
    said_of_references,
    said_of_swapped,
)
from plateviz.verdict.prior_words import said_of_prior

_NM_PER_UM = 1000.0
_ORDINALS = {2: "second", 3: "third"}
_MOST_NAMED, _HIGHEST_ORDER = 8, 9


def said_of(case: Case) -> Said:
    """Return what is said of a cause."""
    return _WORDS[case.found.test.subject](case)


def _size(case: Case) -> str:
    return f"{rounded(_NM_PER_UM * case.found.test.size_um, 3)} nm rms on the focal plane"


def _fall(case: Case) -> str:
    test = case.found.test
    # Scaled, because a stated noise that is too small would make every cause look large.
    return (
        f"χ², scaled to the scatter that is left, would fall by {test.statistic:,.0f} with "
        f"{test.expected:.0f} parameters more"
    )


def _degree(case: Case) -> str:
    return f"terms of the {_ORDINALS[case.found.test.what[0]]} degree"


def _changes(name: str, title: str, how: str, verb: str, option: str) -> Callable[[Case], Said]:
    def said(case: Case) -> Said:
        words = f"The {_degree(case)} {how}: {_size(case)}; {_fall(case)}."
        options = (f"{option} {case.found.test.what[0]}",)
        return Said(name, title, words, f"let the distortion {verb} in the fit", options)

    return said


def _step(case: Case) -> Said:
    step = case.diagnosis.patterns.times[-case.diagnosis.patterns.n_steps :][
        case.found.test.what[1]
    ]
    # The exposures are in order of the fields, which may be numbered otherwise than in time.
    later = case.result.exposures[step > 0.0]
    first = int(later.loc[later["obstime"].idxmin(), "field_id"])
    return Said(
        "distortion-steps",
        f"the distortion changes at field {first}",
        f"The {_degree(case)} are not the same before and after: {_size(case)}; {_fall(case)}.",
        "give each field a distortion of its own in the fit",
        (f"--field-distortion {case.found.test.what[0]}",),
    )


def _velocity(case: Case) -> Said:
    return Said(
        "velocity",
        "the satellite's velocity is left out",
        "The residuals have the pattern of an aberration that changes with time: "
        f"{_size(case)}; {_fall(case)}.",
        "give the satellite's velocity in the columns satellite_vx, satellite_vy and satellite_vz",
    )


def _order(case: Case) -> Said:
    order = int(case.result.summary["order"])
    return Said(
        "order",
        "the order of the distortion is too low",
        f"Terms above degree {order} remain in the residuals, the same in all exposures: "
        f"{_size(case)}; {_fall(case)}.",
        "raise the order",
        (f"--order {min(order + 2, _HIGHEST_ORDER)}",),
    )


def _detector(case: Case) -> str:
    rows = case.result.calibration
    labels = rows.loc[rows["group"] == "detector_x", "label"]
    return str(labels.iloc[case.found.test.what[0]])


def _moves(name: str, verb: str) -> Callable[[Case], Said]:
    def said(case: Case) -> Said:
        detector = _detector(case)
        return Said(
            name,
            f"{detector} {verb} during the orbit",
            f"Its residuals change with time, against those of the others: {_size(case)}; "
            f"{_fall(case)}.",
            "let the detectors move from field to field in the fit",
            ("--detector-motion",),
        )

    return said


def _cells(case: Case) -> Said:
    order = int(case.result.summary["order"])
    return Said(
        "map",
        "the mean residuals over the detectors have a pattern",
        f"No other cause explains it: {_size(case)}; {_fall(case)}.",
        "look at the map of the mean residuals; if it is smooth, raise the order",
        (f"--order {min(order + 2, _HIGHEST_ORDER)}",),
    )


def _along(name: str, title: str, words: str, action: str, option: str) -> Callable[[Case], Said]:
    """Return what is said of a shift along an axis of the detectors, "{}" in the title."""

    def said(case: Case) -> Said:
        axis = "xy"[case.found.test.what[0]]
        evidence = f"{words}: {_size(case)}; {_fall(case)}."
        return Said(f"{name}-{axis}", title.format(axis), evidence, action, (option,))

    return said


def _of_each(
    name: str,
    words: str,
    action: str = "the model has no term for it; take its size as an error of the positions",
    *options: str,
) -> Callable[[Case], Said]:
    def said(case: Case) -> Said:
        evidence = f"Each exposure has its own amount; {_fall(case)}."
        return Said(name, words, evidence, action, options)

    return said


def _swing(case: Case) -> Said:
    rows = case.result.exposures.iloc[list(case.found.items)]
    pairs = [f"{int(f)}/{int(p)}" for f, p in zip(rows["field_id"], rows["plate_id"], strict=True)]
    named = ", ".join(pairs[:_MOST_NAMED])
    return Said(
        "jitter",
        f"the pointing jittered in {len(pairs)} exposure{'s' if len(pairs) > 1 else ''}",
        f"Residuals change along the rows, as the detectors are read (field/exposure {named}).",
        "leave these exposures out",
        tuple(f"--exclude exposure={pair}" for pair in pairs),
    )


_WORDS: dict[str, Callable[[Case], Said]] = {
    "drift": _changes(
        "distortion-drifts",
        "the distortion drifts",
        "change steadily from the first exposure to the last",
        "drift",
        "--drift",
    ),
    "bend": _changes(
        "distortion-oscillates",
        "the distortion changes with the phase of the orbit about the Earth",
        "oscillate with that period",
        "breathe",
        "--breathing",
    ),
    "step": _step,
    "velocity": _velocity,
    "order": _order,
    "shift": _moves("detector-shifts", "shifts"),
    "turn": _moves("detector-turns", "turns"),
    "cells": _cells,
    "map": _cells,
    "phase": _along(
        "pixel-phase",
        "measured positions depend on the place within the pixel, along {}",
        "The residuals follow a wave with the period of a pixel",
        "include the shift in the fit, or correct the centring of the images",
        "--pixel-phase",
    ),
    "magnitude": _along(
        "charge-transfer",
        "faint stars are shifted along {} of the detectors, as charge transfer does",
        "The shift grows along the axis",
        "include the shift in the fit, or correct the measured positions",
        "--charge-transfer",
    ),
    "noise": said_of_noise,
    "exposures": said_of_noise_of(
        "noise-of-exposures",
        "the noise differs between exposures",
        "let the fit estimate the noise of each exposure, or leave out the worst",
        "--noise-by-exposure",
    ),
    "magnitudes": said_of_noise_of(
        "noise-of-magnitudes",
        "the noise depends on magnitude otherwise than stated",
        "let the fit estimate how the noise depends on magnitude",
        "--noise-by-magnitude",
    ),
    "detectors": said_of_noise_of(
        "noise-of-detectors",
        "the noise differs between detectors",
        "state the uncertainties sx and sy of each detector",
    ),
    "sources": said_of_noise_of(
        "sources",
        "some sources scatter by more than their noise",
        "look at the sources that scatter most; they may be double or wrongly identified",
    ),
    "epoch": said_of_epoch,
    "kurtosis": said_of_kurtosis,
    "outliers": said_of_outliers,
    "swapped": said_of_swapped,
    "stretch": _of_each(
        "anisotropy",
        "focal lengths along x and y differ",
        "give each axis a focal length of its own in the fit",
        "--focal-anisotropy",
    ),
    "shear": _of_each("shear", "the axes of the focal plane are not at right angles"),
    "quadratic": _of_each("distortion-of-exposures", "the distortion changes between exposures"),
    "swing": _swing,
    "references": said_of_references,
    "reference": said_of_reference,
    "others": said_of_others,
    "other": said_of_other,
    "prior": said_of_prior,
}
