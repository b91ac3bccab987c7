"""Tables from which a run as a whole is tested: of each orbit, and of all together."""

from solver.data.columns import Column, Table

_ORBIT = Column("orbit_id", "int64", "", "satellite orbit")
_EPOCH = Column("epoch", "float64", "d", "mean epoch of the orbit, MJD in TCB")
_SOURCE = Column("source_id", "int64", "", "source")
_AXES = ("ra", "dec")

# Degrees to the East and to the North of the monomials of smooth fields on the sky.
FIELD_DEGREES = tuple((n - j, j) for n in range(4) for j in range(n + 1))
FRAME_DEGREES = tuple(pair for pair in FIELD_DEGREES if sum(pair) <= 2)
# Six terms of the distortion, and polynomials towards each of East and North.
N_SKY_STATISTICS = 6 + 2 * len(FRAME_DEGREES) + 2 * len(FIELD_DEGREES)

# What the solution of an orbit says about smooth errors of the catalogue.
SKY_STATISTICS = Table(
    "sky_statistics",
    (
        Column("kind", "str", "", "distortion, frame or field"),
        Column("element", "int64", "", "number among those of the kind"),
        Column(
            "value",
            "float64",
            "",
            "quadratic coefficient of the distortion, um; coefficient of the frame, zero because "
            "one orbit does not know it; slope of the log posterior along a field, 1/mas",
        ),
        Column("centre_ra", "float64", "deg", "RA of the centre of the fields"),
        Column("centre_dec", "float64", "deg", "Dec of the centre of the fields"),
        *(
            Column(f"field_{number:02d}", "float64", "", f"change per mas of field {number}")
            for number in range(2 * len(FIELD_DEGREES))
        ),
        *(
            Column(f"noise_{number:02d}", "float64", "", f"covariance with row {number}, of noise")
            for number in range(N_SKY_STATISTICS)
        ),
    ),
    key=("kind", "element"),
)

SKY_RESPONSES = Table(
    "sky_responses",
    (
        _SOURCE,
        *(
            Column(f"{axis}_{number:02d}", "float64", "", f"change of row {number} per sigma")
            for axis in _AXES
            for number in range(N_SKY_STATISTICS)
        ),
    ),
    key=("source_id",),
)

# The calibration of every orbit of a run.
CALIBRATIONS = Table(
    "calibrations",
    (
        _ORBIT,
        _EPOCH,
        Column("position_angle", "float64", "deg", "mean position angle of the exposures"),
        Column("group", "str", "", "group of parameters, or a degree of the distortion"),
        Column("label", "str", "", "parameter"),
        Column("value", "float64", "", "its value, in its unit"),
        Column("unit", "str", "", "of the value"),
    ),
    key=("orbit_id", "group", "label"),
)

# The tests of every orbit of a run, as in its verdict.
ORBIT_TESTS = Table(
    "orbit_tests",
    (
        _ORBIT,
        Column("name", "str", "", "test of the orbit"),
        Column("sigma", "float64", "", "its chance as the distance of a normal value"),
    ),
    key=("orbit_id", "name"),
)

# The verdict of every orbit of a run with its causes, a row each; one row where there are none.
ORBIT_CAUSES = Table(
    "orbit_causes",
    (
        _ORBIT,
        Column("state", "str", "", "good, warn or bad"),
        Column("name", "str", "", "of the cause; empty where there is none"),
        Column("title", "str", "", "the cause as a clause"),
        Column("significance", "float64", "", "in sigmas"),
        Column(
            "words",
            "str",
            "",
            "the evidence, in sentences",
            # Runs of older versions lack it.
            required=False,
            default="",
        ),
        Column("spoils", "str", "", "what it spoils, and by how much"),
        Column("action", "str", "", "what to do"),
        Column("options", "str", "", "options of `plateviz fit` that do it, a line each"),
        Column("is_large", "bool", "", "whether the orbit should not be trusted because of it"),
    ),
    key=("orbit_id", "name", "title"),
)

# The smooth errors of the catalogue as all orbits of a run see them; a row per field.
ZONAL_FIELD = Table(
    "zonal_field",
    (
        Column("axis", "str", "", "direction of the displacement, ra or dec"),
        Column("degree_ra", "int64", "", "degree of the monomial to the East"),
        Column("degree_dec", "int64", "", "degree of the monomial to the North"),
        Column("coefficient", "float64", "", "of the most likely field, mas per deg to the degree"),
        *(
            Column(f"scatter_{number:02d}", "float64", "", "part of a coefficient by chance")
            for number in range(2 * len(FIELD_DEGREES))
        ),
        *(
            Column(name, "float64", unit, f"{meaning}; the same in all rows")
            for name, unit, meaning in (
                ("centre_ra", "deg", "RA of the centre"),
                ("centre_dec", "deg", "Dec of the centre"),
                ("half_ra", "deg", "half width of the area to the East"),
                ("half_dec", "deg", "half width of the area to the North"),
                ("chi2", "", "with the chance of the weighted sum of squares that is tested"),
                ("dof", "", "degrees of freedom of this chi2"),
                ("rms", "mas", "of the field along an axis, by the excess of chi2"),
                ("typical", "mas", "rms of a field that is seen in half of such runs"),
            )
        ),
    ),
    key=("axis", "degree_ra", "degree_dec"),
)

RUN_TABLES = (CALIBRATIONS, ORBIT_TESTS, ORBIT_CAUSES, ZONAL_FIELD)
