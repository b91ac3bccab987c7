"""ModelSettings: the settings of the observation model, of which some add parameter groups."""

from dataclasses import dataclass

from solver.data.setting_kinds import Change, Degree, Positive, Switch, Whole, setting

MAX_ORDER = 9
# Period of a circular orbit 600 km above the Earth, the paper's section "Discussion".
ORBITAL_PERIOD_MIN = 96.7


def _switch(label: str, help_text: str, option: str, card: str, phrase: str) -> bool:
    """Return the field of a cause that is modelled or not."""
    return setting(
        False,
        Switch(
            label=label,
            help=help_text,
            keyword=option.replace("-", "_"),
            option=option,
            control=True,
            change=Change.REFIT,
            card=card,
            phrase=phrase,
            is_cause=True,
        ),
    )


def _degree(label: str, help_text: str, option: str, card: str, phrase: str) -> int:
    """Return the field of a cause that changes the distortion terms up to a degree."""
    return setting(
        0,
        Degree(
            label=label,
            help=f"{help_text} up to this degree, 2 to {MAX_ORDER}; 0 for none.",
            high=MAX_ORDER,
            keyword=option.replace("-", "_"),
            option=option,
            control=True,
            change=Change.REFIT,
            card=card,
            phrase=phrase,
            is_cause=True,
        ),
    )


@dataclass(frozen=True)
class ModelSettings:
    """What the observation model comprises; all but `order` and `aberration` are causes.

    A cause is an effect that the paper's model lacks. All are off by default.
    """

    order: int = setting(
        5,
        Whole(
            label="Distortion order",
            help=f"Distortion order, 0 to {MAX_ORDER}: the highest total degree of its terms.",
            low=0,
            high=MAX_ORDER,
            keyword="order",
            option="order",
            control=True,
            change=Change.WHAT_IF,
            card="ORDER",
            phrase="order {}",
            is_always_described=True,
        ),
    )
    aberration: bool = setting(
        True,
        Switch(
            label="Stellar aberration",
            help="Model the stellar aberration due to the observer's velocity.",
            keyword="aberration",
            option="aberration",
            control=True,
            change=Change.REFIT,
            card="ABERR",
            phrase="no aberration",
        ),
    )
    focal_anisotropy: bool = _switch(
        "Focal length for each axis",
        "Let the focal length along y differ from that along x in each exposure.",
        "focal-anisotropy",
        "ANISO",
        "focal length for each axis",
    )
    drift: int = _degree(
        "Drift of the distortion",
        "Let distortion terms change with time, as a polynomial over the orbit,",
        "drift",
        "DRIFT",
        "drift {}",
    )
    drift_in_time: int = setting(
        1,
        Whole(
            label="Degree of the drift in time",
            help="Degree in time of the polynomial by which the distortion drifts.",
            high=MAX_ORDER,
            keyword="drift_in_time",
            option="drift-in-time",
            control=True,
            change=Change.REFIT,
            card="DRIFTT",
            phrase="drift of degree {} in time",
            is_cause=True,
        ),
    )
    drift_walk: int = _degree(
        "Random walk of the distortion",
        "Let distortion terms change from exposure to exposure, as a random walk,",
        "drift-walk",
        "DRIFTWLK",
        "random walk {}",
    )
    breathing: int = _degree(
        "Breathing of the distortion",
        "Let distortion terms oscillate with the phase of the satellite's orbit,",
        "breathing",
        "BREATH",
        "breathing {}",
    )
    breathing_period: float = setting(
        ORBITAL_PERIOD_MIN,
        Positive(
            label="Period of the breathing",
            help="Period of the satellite's orbit, minutes.",
            unit="min",
            keyword="breathing_period",
            option="breathing-period",
            control=True,
            change=Change.REFIT,
            card="BREATHP",
            phrase="breathing in {} min",
            is_cause=True,
        ),
    )
    field_distortion: int = _degree(
        "Distortion of each field",
        "Let distortion terms change from field to field,",
        "field-distortion",
        "FIELDIST",
        "field distortion {}",
    )
    detector_distortion: int = _degree(
        "Distortion of each detector",
        "Give each detector distortion terms of its own, about its centre, and a skew,",
        "detector-distortion",
        "DETDIST",
        "detector distortion {}",
    )
    detector_motion: bool = _switch(
        "Motion of the detectors",
        "Let each detector move and turn from field to field.",
        "detector-motion",
        "DETMOVE",
        "detectors move",
    )
    charge_transfer: bool = _switch(
        "Charge transfer",
        "Let stars be shifted along the axes of each detector in proportion to the pixels that "
        "their charge crosses and to flux^-1/2.",
        "charge-transfer",
        "CHARGE",
        "charge transfer",
    )
    magnitude_shift: bool = _switch(
        "Shift by magnitude",
        "Let stars be shifted along the axes of each detector in proportion to flux^-1/2.",
        "magnitude-shift",
        "MAGSHIFT",
        "shift by magnitude",
    )
    pixel_phase: bool = _switch(
        "Shift by pixel phase",
        "Let stars be shifted along the axes of each detector by their place within a pixel.",
        "pixel-phase",
        "PIXPHASE",
        "pixel phase",
    )
    noise_scale: bool = _switch(
        "Scale of the noise",
        "Estimate one factor on the uncertainties of all measurements.",
        "noise-scale",
        "NOISE",
        "noise scaled",
    )
    noise_by_exposure: bool = _switch(
        "Noise of each exposure",
        "Estimate a factor on the uncertainties of the measurements of each exposure.",
        "noise-by-exposure",
        "NOISEEXP",
        "noise by exposure",
    )
    noise_by_magnitude: bool = _switch(
        "Noise by magnitude",
        "Estimate a factor on the uncertainties whose logarithm is cubic in the magnitude.",
        "noise-by-magnitude",
        "NOISEMAG",
        "noise by magnitude",
    )
    noise_floor: bool = _switch(
        "Floor of the noise",
        "Estimate a floor that is added in quadrature to the uncertainties of all measurements.",
        "noise-floor",
        "NOISEFLR",
        "noise floor",
    )
    reference_scale: bool = _switch(
        "Scale of the reference errors",
        "Estimate one factor on the catalogue's uncertainties of all reference stars.",
        "reference-scale",
        "REFSCALE",
        "reference errors scaled",
    )
