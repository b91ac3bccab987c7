"""Definition of the input tables: column name, type, unit, meaning, limits, aliases.

The column names are those of the published files (paper, tables "Columns of the Ground Truth
Catalog" and "Inputs, Model Parameters, and Priors"). The limits are wide enough for every
mission.
"""

from dataclasses import replace
from math import inf

from solver.data.columns import Column, Table

EXPOSURE_KEY = ("orbit_id", "field_id", "plate_id")
ORBIT = Column("orbit_id", "int64", "", "satellite orbit")
FIELD = Column("field_id", "int64", "", "field of the orbit")
PLATE = Column("plate_id", "int64", "", "exposure of the field")
_DETECTOR = Column("detector_id", "int64", "", "detector")
SOURCE = Column("source_id", "int64", "", "source")
MEASURED = (ORBIT, FIELD, PLATE, _DETECTOR, SOURCE)
OBSTIME = Column(
    "obstime",
    "float64",
    "d",
    "time of the exposure, MJD in TCB",
    ("exptime", "time", "mjd"),
    # 1968 to 2105. Zero is a missing value, and a Julian date is larger by 2,400,000.5.
    limits=(40_000.0, 90_000.0),
)
# Optional and without a default: NaN where a table has none, so that it can be told from any value.
_MAGNITUDE = Column(
    "magnitude",
    "float64",
    "mag",
    "magnitude",
    ("phot_g_mean_mag",),
    required=False,
    limits=(-30.0, 50.0),
    may_be_nan=True,
)
_PIXELS = (-1e6, 1e6)
_SCATTER = (1e-7, 1e3)
# One turn either way, so that angles about zero may be negative.
_TURN = (-360.0, 360.0)
_DECLINATION = (-90.0, 90.0)
# From a nanoarcsecond to a degree.
_POSITION_ERROR = (1e-6, 3.6e6)
# Barnard's star moves by 10,400 mas a year; Proxima's parallax is 768 mas. Measured parallaxes of
# far stars may be negative.
_MOTION = (-2e4, 2e4)
_PARALLAX = (-2e3, 2e3)

MEASUREMENT = Table(
    "measurement",
    (
        *MEASURED,
        Column("nx", "float64", "pix", "measured x, from the detector centre", limits=_PIXELS),
        Column("ny", "float64", "pix", "measured y, from the detector centre", limits=_PIXELS),
        Column("sx", "float64", "pix", "uncertainty of nx", ("sx0",), limits=_SCATTER),
        Column("sy", "float64", "pix", "uncertainty of ny", ("sy0",), limits=_SCATTER),
        _MAGNITUDE,
    ),
    key=(*EXPOSURE_KEY, "detector_id", "source_id"),
    aliases=("measurements", "obs", "observation"),
)

ENVIRONMENT = Table(
    "environment",
    (
        ORBIT,
        FIELD,
        PLATE,
        OBSTIME,
        Column(
            "ra_est",
            "float64",
            "deg",
            "estimated pointing, RA",
            ("ra est", "ra_tel", "ra"),
            limits=_TURN,
        ),
        Column(
            "dec_est",
            "float64",
            "deg",
            "estimated pointing, Dec",
            ("dec est", "dec_tel", "dec"),
            limits=_DECLINATION,
        ),
        Column(
            "pa_est",
            "float64",
            "deg",
            "estimated position angle",
            ("pa est", "theta_tel", "pa"),
            limits=_TURN,
        ),
        Column(
            "focal_length",
            "float64",
            "um",
            "estimated focal length",
            ("focal length", "foc_tel"),
            # A millimetre to a kilometre.
            limits=(1e3, 1e9),
        ),
        *(
            Column(
                f"satellite_v{axis}",
                "float64",
                "km / s",
                f"geocentric velocity of the satellite, BCRS {axis}",
                required=False,
                default=0.0,
                limits=(-100.0, 100.0),
            )
            for axis in "xyz"
        ),
    ),
    key=EXPOSURE_KEY,
    aliases=("exposures", "exposure", "env"),
)


def _correlation(first: str, second: str) -> Column:
    return Column(
        f"{first}_{second}_corr",
        "float64",
        "",
        f"correlation of {first} and {second}",
        required=False,
        default=0.0,
        limits=(-1.0, 1.0),
    )


_ASTROMETRY = ("ra", "dec", "parallax", "pmra", "pmdec")

CATALOGUE = Table(
    "catalogue",
    (
        SOURCE,
        Column("ra", "float64", "deg", "right ascension at ref_epoch", limits=_TURN),
        Column("dec", "float64", "deg", "declination at ref_epoch", limits=_DECLINATION),
        Column("ra_error", "float64", "mas", "uncertainty of ra cos(dec)", limits=_POSITION_ERROR),
        Column("dec_error", "float64", "mas", "uncertainty of dec", limits=_POSITION_ERROR),
        Column("pmra", "float64", "mas / yr", "proper motion in RA times cos(dec)", limits=_MOTION),
        Column("pmdec", "float64", "mas / yr", "proper motion in Dec", limits=_MOTION),
        Column("pmra_error", "float64", "mas / yr", "uncertainty of pmra", limits=(0.0, 2e4)),
        Column("pmdec_error", "float64", "mas / yr", "uncertainty of pmdec", limits=(0.0, 2e4)),
        Column("parallax", "float64", "mas", "parallax", limits=_PARALLAX),
        Column(
            "parallax_error",
            "float64",
            "mas",
            "uncertainty of parallax",
            required=False,
            default=0.0,
            limits=(0.0, 2e3),
        ),
        Column(
            "ref_epoch",
            "float64",
            "yr",
            "reference epoch, Julian year in TCB",
            limits=(1850.0, 2150.0),
        ),
        Column(
            "is_reference",
            "bool",
            "",
            "reference source",
            ("reference_flag", "flag_ref", "is_ref"),
        ),
        Column(
            "is_artificial",
            "bool",
            "",
            "artificial source of a simulation",
            ("artificial_flag", "flag_test", "flag_art", "test_flag"),
            required=False,
            default=False,
        ),
        *(
            _correlation(first, second)
            for i, first in enumerate(_ASTROMETRY)
            for second in _ASTROMETRY[i + 1 :]
        ),
        _MAGNITUDE,
    ),
    key=("source_id",),
    aliases=("reference", "ref", "catalog"),
)

# The errors of a true catalogue are not used, and its flags repeat those of the catalogue.
_TRUTH_OPTIONAL = {
    "ra_error",
    "dec_error",
    "pmra_error",
    "pmdec_error",
    "is_reference",
}

TRUTH = Table(
    "truth",
    tuple(
        replace(c, required=False, limits=(-inf, inf)) if c.name in _TRUTH_OPTIONAL else c
        for c in CATALOGUE
        if not c.name.endswith("_corr")
    ),
    key=("source_id",),
    aliases=("ground_truth", "gt"),
)
