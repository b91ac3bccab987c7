"""The one table of parameter groups (paper, table "Inputs, Model Parameters, and Priors").

The blocks of the Gauss-Newton engine, the priors, the command line's `--prior`, the
dashboard's controls and the result tables are derived from this table. A new group is one
entry here and one term in `solver.model.forward`.
"""

from solver.data.parameter_group import DISTORTION_AXES, Group, Published
from solver.data.parameter_group import Axis as Axis
from solver.data.parameter_group import PriorFamily as PriorFamily

# The paper gives the prior of the focal length as a variance of 100 on a scale in um/deg. The
# simulated scatter (1e-3) agrees with a standard deviation of 100 um/deg instead (1.2e-3).
_FOCAL_WIDTH_UM = 100.0 * 57.29577951308232

SOURCES = Group(
    "sources",
    "source positions",
    "α_i, δ_i",
    "src",
    "mas",
    "deg",
    "normal",
    1.0,  # a factor on the catalogue's own uncertainties
    centre_from="catalogue",
)

# The groups of every fit.
_ALWAYS: tuple[Group, ...] = (
    SOURCES,
    Group(
        "pointing_ra",
        "pointing RA",
        "α_tel cos δ_tel",
        "exp",
        "arcsec",
        "deg",
        "normal",
        3600.0,
        centre_from="environment",
        column="ra_est",
        published=(Published("tel_a_loc", "RA of the optical axis"),),
    ),
    Group(
        "pointing_dec",
        "pointing Dec",
        "δ_tel",
        "exp",
        "arcsec",
        "deg",
        "normal",
        3600.0,
        centre_from="environment",
        column="dec_est",
        published=(Published("tel_d_loc", "Dec of the optical axis"),),
    ),
    Group(
        "position_angle",
        "position angle",
        "θ_tel",
        "exp",
        "arcsec",
        "deg",
        "uniform",
        float("inf"),
        centre_from="environment",
        column="pa_est",
        published=(Published("tel_t_loc", "position angle"),),
    ),
    Group(
        "focal_length",
        "focal length",
        "F",
        "exp",
        "um",
        "um",
        "gamma",
        _FOCAL_WIDTH_UM,
        centre_from="environment",
        column="focal_length",
        published=(
            Published("tel_f_loc_x", "focal length"),
            Published("tel_f_loc_y", "focal length, the same value"),
        ),
    ),
    Group(
        "distortion_x",
        "distortion A",
        "A_kl",
        "coef",
        "um",
        "um",
        "normal",
        1.0,
        published=(Published("opt_A_loc", "A_kl"),),
    ),
    Group(
        "distortion_y",
        "distortion B",
        "B_kl",
        "coef",
        "um",
        "um",
        "normal",
        1.0,
        published=(Published("opt_B_loc", "B_kl"),),
    ),
    Group(
        "detector_x",
        "detector x",
        "X_det",
        "det",
        "um",
        "um",
        "normal",
        100.0,
        centre_from="instrument",
        column="x_um",
        published=(Published("det_o_loc_x", "x of the centre"),),
    ),
    Group(
        "detector_y",
        "detector y",
        "Y_det",
        "det",
        "um",
        "um",
        "normal",
        100.0,
        centre_from="instrument",
        column="y_um",
        published=(Published("det_o_loc_y", "y of the centre"),),
    ),
    Group(
        "detector_rotation",
        "detector rotation",
        "θ_det",
        "det",
        "arcsec",
        "deg",
        "normal",
        360.0,
        centre_from="instrument",
        column="rotation_deg",
        published=(Published("det_r_loc", "rotation"),),
    ),
    Group(
        "pitch_x",
        "pixel pitch x",
        "δ_x",
        "det",
        "um",
        "um",
        "normal",
        0.01,
        relative=True,
        centre_from="instrument",
        column="pitch_x_um",
        published=(Published("det_p_loc_x", "pixel pitch in x"),),
    ),
    Group(
        "pitch_y",
        "pixel pitch y",
        "δ_y",
        "det",
        "um",
        "um",
        "normal",
        0.01,
        relative=True,
        centre_from="instrument",
        column="pitch_y_um",
        published=(Published("det_p_loc_y", "pixel pitch in y"),),
    ),
)


def _pair(name: str, label: str, symbols: str, rest: tuple, setting: str) -> tuple[Group, Group]:
    """Return the groups of both directions: of the distortion A and B, of detectors x and y.

    Parameters
    ----------
    rest : axis, unit and width of the prior, which is normal about zero
    """
    axis, unit, width = rest
    letters = "AB" if axis in DISTORTION_AXES else "xy"
    x, y = (
        Group(
            f"{name}_{direction}",
            f"{label} {letter}",
            symbol,
            axis,
            unit,
            unit,
            "normal",
            width,
            setting=setting,
        )
        for direction, letter, symbol in zip("xy", letters, symbols.split(), strict=True)
    )
    return x, y


# Groups that a fit has if their setting is on: causes of errors that the paper's model lacks.
OPTIONAL_GROUPS: tuple[Group, ...] = (
    Group(
        "focal_anisotropy",
        "focal anisotropy",
        "ε_F",
        "exp",
        "ppm",
        "ppm",
        "normal",
        50.0,
        published=(
            Published("tel_f_loc_x", factor=-0.5),
            Published("tel_f_loc_y", factor=0.5),
        ),
        setting="focal_anisotropy",
    ),
    *_pair("drift", "distortion drift", "A_kl,t B_kl,t", ("drift", "um", 1.0), "drift"),
    *_pair("drift_walk", "distortion walk", "A_kl,m B_kl,m", ("walk", "um", 0.01), "drift_walk"),
    *_pair(
        "breathing", "distortion breathing", "A_kl,φ B_kl,φ", ("breathing", "um", 1.0), "breathing"
    ),
    *_pair(
        "field_distortion",
        "field distortion",
        "A_kl,f B_kl,f",
        ("field", "um", 1.0),
        "field_distortion",
    ),
    *_pair(
        "own_distortion",
        "detector distortion",
        "A_kl,det B_kl,det",
        ("own", "um", 1.0),
        "detector_distortion",
    ),
    Group(
        "detector_skew",
        "detector skew",
        "κ_det",
        "det",
        "arcsec",
        "deg",
        "normal",
        100.0,
        setting="detector_distortion",
    ),
    *_pair(
        "detector_motion",
        "detector motion",
        "X_det,f Y_det,f",
        ("motion", "um", 1.0),
        "detector_motion",
    ),
    Group(
        "detector_turn",
        "detector turn",
        "θ_det,f",
        "motion",
        "arcsec",
        "arcsec",
        "normal",
        10.0,
        setting="detector_motion",
    ),
    *_pair(
        "magnitude_shift", "magnitude shift", "m_x m_y", ("det", "mpix", 30.0), "magnitude_shift"
    ),
    *_pair(
        "charge_transfer", "charge transfer", "c_x c_y", ("det", "mpix", 30.0), "charge_transfer"
    ),
    *_pair("phase_sine", "pixel phase sine", "s_x s_y", ("det", "mpix", 30.0), "pixel_phase"),
    *_pair("phase_cosine", "pixel phase cosine", "p_x p_y", ("det", "mpix", 30.0), "pixel_phase"),
)

PARAMETERS = (*_ALWAYS, *OPTIONAL_GROUPS)
# Without the sources and the optional groups.
CALIBRATION_GROUPS = tuple(g for g in _ALWAYS if g.axis != "src")
# Their origins are the axes of a frame on the sky, not a value.
FRAME_GROUPS = ("pointing_ra", "pointing_dec")
BY_NAME = {g.name: g for g in PARAMETERS}


def groups_on(axis: Axis) -> tuple[Group, ...]:
    """Return the groups of every fit with one value per element of `axis`, in table order."""
    return tuple(g for g in _ALWAYS if g.axis == axis)
