"""Definition of every input and result table: column name, type, unit, meaning, aliases.

The result tables use names of this project. `solver.io` maps them to and from files.
"""

import math

from solver.data.columns import Column, Table
from solver.data.eigenmode_schema import EIGENMODE_TABLES
from solver.data.input_schema import CATALOGUE as CATALOGUE
from solver.data.input_schema import ENVIRONMENT as ENVIRONMENT
from solver.data.input_schema import EXPOSURE_KEY, FIELD, MEASURED, OBSTIME, ORBIT, PLATE, SOURCE
from solver.data.input_schema import MEASUREMENT as MEASUREMENT
from solver.data.input_schema import TRUTH as TRUTH
from solver.data.order_schema import ORDERS as ORDERS

SOURCES = Table(
    "sources",
    (
        SOURCE,
        Column("is_reference", "bool", "", "reference source"),
        Column("is_artificial", "bool", "", "artificial source of a simulation"),
        Column("n_obs", "int64", "", "number of measurements"),
        Column("ra", "float64", "deg", "estimated RA at the mean epoch, without aberration"),
        Column("dec", "float64", "deg", "estimated Dec at the mean epoch, without aberration"),
        Column("sigma_ra_conditional", "float64", "mas", "conditional sigma of ra cos(dec)"),
        Column("sigma_dec_conditional", "float64", "mas", "conditional sigma of dec"),
        Column("corr_conditional", "float64", "", "conditional RA-Dec correlation"),
        Column("sigma_ra_marginal", "float64", "mas", "marginal sigma of ra cos(dec)"),
        Column("sigma_dec_marginal", "float64", "mas", "marginal sigma of dec"),
        Column("corr_marginal", "float64", "", "marginal RA-Dec correlation"),
        Column("prior_ra", "float64", "deg", "prior RA at the mean epoch"),
        Column("prior_dec", "float64", "deg", "prior Dec at the mean epoch"),
        Column("prior_sigma_ra", "float64", "mas", "prior sigma of ra cos(dec)"),
        Column("prior_sigma_dec", "float64", "mas", "prior sigma of dec"),
        Column(
            "prior_corr",
            "float64",
            "",
            "prior RA-Dec correlation",
            # Results of older versions lack it.
            required=False,
            default=0.0,
        ),
        *(
            # Results of older versions lack them.
            Column(
                f"prior_pm{axis}",
                "float64",
                "mas / yr",
                f"proper motion in {words}, with which the prior is at the mean epoch; NaN if none",
                required=False,
                default=math.nan,
                may_be_nan=True,
            )
            for axis, words in (("ra", "RA times cos(dec)"), ("dec", "Dec"))
        ),
        Column("offset_ra", "float64", "mas", "estimate minus prior, ra cos(dec)"),
        Column("offset_dec", "float64", "mas", "estimate minus prior, dec"),
        Column("chi2", "float64", "", "sum of squared whitened residuals"),
        Column("dof", "float64", "", "expected chi2: 2 n_obs less the leverage"),
        Column(
            "magnitude",
            "float64",
            "mag",
            "magnitude in the catalogue; NaN where it has none",
            required=False,
            default=math.nan,
            may_be_nan=True,
        ),
    ),
    key=("source_id",),
)

RESIDUALS = Table(
    "residuals",
    (
        *MEASURED,
        Column("nx", "float64", "pix", "measured x"),
        Column("ny", "float64", "pix", "measured y"),
        Column("sx", "float64", "pix", "uncertainty of nx"),
        Column("sy", "float64", "pix", "uncertainty of ny"),
        Column("model_x", "float64", "pix", "predicted x"),
        Column("model_y", "float64", "pix", "predicted y"),
        Column("residual_x", "float64", "pix", "measured minus predicted x"),
        Column("residual_y", "float64", "pix", "measured minus predicted y"),
        Column(
            "standardised_x",
            "float64",
            "",
            "residual in x over its expected scatter, leverage removed",
            may_be_nan=True,
        ),
        Column(
            "standardised_y",
            "float64",
            "",
            "residual in y over its expected scatter, leverage removed",
            may_be_nan=True,
        ),
        Column("leverage", "float64", "", "trace of the 2x2 leverage, 0 to 2"),
        Column("ideal_x", "float64", "um", "undistorted focal-plane x"),
        Column("ideal_y", "float64", "um", "undistorted focal-plane y"),
        Column("focal_x", "float64", "um", "distorted focal-plane x"),
        Column("focal_y", "float64", "um", "distorted focal-plane y"),
    ),
)

CALIBRATION = Table(
    "calibration",
    (
        Column("group", "str", "", "parameter group, as in `solver.data.parameters`"),
        Column("element", "int64", "", "index along the group's axis"),
        Column("label", "str", "", "the element in words: 'field 0 plate 3', 'A(2,0)'"),
        Column("value", "float64", "", "estimate, in value_unit"),
        Column("prior_centre", "float64", "", "centre of the prior, in value_unit"),
        Column("value_unit", "str", "", "unit of value and prior_centre"),
        Column("offset", "float64", "", "estimate minus prior centre, in unit"),
        Column("prior_sigma", "float64", "", "width of the prior, in unit; inf where flat"),
        Column("sigma_conditional", "float64", "", "sigma with all else held fixed, in unit"),
        Column("sigma_marginal", "float64", "", "sigma with all else integrated out, in unit"),
        Column("unit", "str", "", "unit of offset and of the sigmas"),
        Column("prior_share", "float64", "", "share of the answer that is prior, 0 to 1"),
    ),
    key=("group", "element"),
)

EXPOSURES = Table(
    "exposures",
    (
        ORBIT,
        FIELD,
        PLATE,
        OBSTIME,
        Column("n_obs", "int64", "", "number of measurements"),
        Column("chi2", "float64", "", "sum of squared whitened residuals"),
        Column("dof", "float64", "", "expected chi2: 2 n_obs less the leverage"),
    ),
    key=EXPOSURE_KEY,
)

TRACE = Table(
    "trace",
    (
        Column("iteration", "int64", "", "iteration, 0 is the start"),
        Column("objective", "float64", "", "chi2 of the data plus that of the priors"),
        Column("chi2", "float64", "", "chi2 of the data"),
        Column("largest_step", "float64", "", "largest step over its uncertainty", may_be_nan=True),
        Column("largest_parameter", "str", "", "the parameter of that step"),
        Column("damping", "float64", "", "share of the step that was not taken, mostly 0"),
        Column("seconds", "float64", "s", "time since the start of the fit"),
    ),
)

OUTLIERS = Table(
    "outliers",
    (
        *MEASURED,
        Column("nx", "float64", "pix", "measured x"),
        Column("ny", "float64", "pix", "measured y"),
        Column("residual_x", "float64", "pix", "measured minus predicted x"),
        Column("residual_y", "float64", "pix", "measured minus predicted y"),
        Column("distance", "float64", "", "residual over its uncertainty, both coordinates"),
        Column("shift_ra", "float64", "", "shift of the source if used, over its marginal sigma"),
        Column("shift_dec", "float64", "", "the same in Dec"),
    ),
)

LOSSES = Table(
    "losses",
    (
        Column("step", "int64", "", "step of the svi engine, from 1"),
        Column("loss", "float64", "", "minus the evidence lower bound, of one draw"),
    ),
)

TRUE_PLACES = Table(
    "true_places",
    (
        SOURCE,
        Column("ra", "float64", "deg", "true RA at the mean epoch, without aberration"),
        Column("dec", "float64", "deg", "true Dec at the mean epoch, without aberration"),
        Column("induced_ra", "float64", "mas", "shift that the reference stars' errors cause"),
        Column("induced_dec", "float64", "mas", "shift that the reference stars' errors cause"),
    ),
    key=("source_id",),
)

_FIT_TABLES = (SOURCES, RESIDUALS, CALIBRATION, EXPOSURES, TRACE, LOSSES, OUTLIERS, TRUE_PLACES)
RESULT_TABLES = (*_FIT_TABLES, ORDERS, *EIGENMODE_TABLES)
