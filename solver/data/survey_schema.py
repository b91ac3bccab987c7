"""Tables of a survey fitted orbit by orbit: rows from each orbit, and combined results."""

from solver.data.columns import Column, Table

_SOURCE = Column("source_id", "int64", "", "source")
_CLASS = (
    Column("is_reference", "bool", "", "reference source"),
    Column("is_artificial", "bool", "", "artificial source of a simulation"),
)
_ORBIT = Column("orbit_id", "int64", "", "satellite orbit")
_EPOCH = Column("epoch", "float64", "d", "mean epoch of the orbit, MJD in TCB")
_AXES = ("ra", "dec")


def _covariance(kind: str, meaning: str) -> tuple[Column, ...]:
    """Return the columns of a 2 x 2 position covariance."""
    return (
        Column(f"sigma_ra_{kind}", "float64", "mas", f"{meaning}, sigma of ra cos(dec)"),
        Column(f"sigma_dec_{kind}", "float64", "mas", f"{meaning}, sigma of dec"),
        Column(f"corr_{kind}", "float64", "", f"{meaning}, RA-Dec correlation"),
    )


_NOISE = _covariance("noise", "part of the marginal covariance that is independent between orbits")
_SHARED = _covariance("catalogue", "part from the catalogue's errors, common to all orbits")

ERROR_BUDGET = Table("error_budget", (_SOURCE, *_NOISE, *_SHARED), key=("source_id",))

N_DRAWS = 32

SHARED_ERRORS = Table(
    "shared_errors",
    (
        _SOURCE,
        *(
            Column(f"{axis}_{draw:02d}", "float32", "mas", f"shift of {axis} in draw {draw}")
            for axis in _AXES
            for draw in range(N_DRAWS)
        ),
    ),
    key=("source_id",),
)

HISTORY = Table(
    "history",
    (
        _SOURCE,
        _ORBIT,
        _EPOCH,
        *_CLASS,
        Column("n_obs", "int64", "", "number of measurements in the orbit"),
        Column("ra", "float64", "deg", "estimated RA at the epoch, without aberration"),
        Column("dec", "float64", "deg", "estimated Dec at the epoch, without aberration"),
        Column("offset_ra", "float64", "mas", "estimate minus catalogue, ra cos(dec)"),
        Column("offset_dec", "float64", "mas", "estimate minus catalogue, dec"),
        *_covariance("conditional", "calibration held fixed"),
        *_covariance("marginal", "calibration integrated out"),
        *_NOISE,
        *_SHARED,
        Column("prior_sigma_ra", "float64", "mas", "prior sigma of ra cos(dec)"),
        Column("prior_sigma_dec", "float64", "mas", "prior sigma of dec"),
        *(
            Column(
                f"true_offset_{axis}",
                "float64",
                "mas",
                f"truth minus catalogue in {axis}; NaN without truth",
                may_be_nan=True,
            )
            for axis in _AXES
        ),
        Column("chi2", "float64", "", "sum of squared whitened residuals"),
        Column("dof", "float64", "", "expected chi2: 2 n_obs less the leverage"),
    ),
    key=("source_id", "orbit_id"),
)

# Offsets from the catalogue at the epoch of the fit, in the order of the fit's parameters.
MOTION_PARAMETERS = ("ra", "dec", "parallax", "pmra", "pmdec")
MOTION_UNITS = ("mas", "mas", "mas", "mas / yr", "mas / yr")


def _of_motion(prefix: str, meaning: str) -> tuple[Column, ...]:
    return tuple(
        Column(f"{prefix}_{name}", "float64", unit, f"{meaning}, {name}", may_be_nan=True)
        for name, unit in zip(MOTION_PARAMETERS, MOTION_UNITS, strict=True)
    )


def _per_axis(prefix: str, meaning: str) -> tuple[Column, ...]:
    return tuple(
        Column(f"{prefix}_{axis}", "float64", "mas", f"{meaning}, {axis}", may_be_nan=True)
        for axis in _AXES
    )


MOTIONS = Table(
    "motions",
    (
        _SOURCE,
        *_CLASS,
        Column("n_orbits", "int64", "", "number of orbits that measured the source"),
        Column("n_obs", "int64", "", "number of measurements in all of them"),
        Column("span", "float64", "yr", "time from the first to the last orbit"),
        Column("epoch", "float64", "yr", "epoch of the fit, Julian year in TCB"),
        *_of_motion("fit", "fitted minus catalogue"),
        *_of_motion("sigma_noise", "sigma of the fit from measurement noise"),
        *_of_motion(
            "sigma_catalogue", "sigma of the fit from the catalogue's errors, common to all orbits"
        ),
        *_of_motion("sigma", "total sigma of the fit"),
        *_of_motion("true", "truth minus catalogue"),
        *_of_motion("pull", "fitted minus true, over sigma"),
        Column("chi2", "float64", "", "chi2 of the fit, weighted by the noise", may_be_nan=True),
        Column("dof", "int64", "", "degrees of freedom of chi2"),
        *_per_axis("scatter", "standard deviation of the orbits' positions about the motion"),
        *_per_axis("expected_scatter", "scatter predicted from the noise of each orbit"),
        *_per_axis("mean_deviation", "mean of estimate minus truth over the orbits"),
        *_per_axis("expected_deviation", "sigma of that mean, from noise and catalogue"),
        *_per_axis("rms_truth", "rms separation from the truth in one coordinate"),
        Column("rms_truth_2d", "float64", "mas", "rms separation from the truth", may_be_nan=True),
        *_per_axis("rms_catalogue", "rms separation from the catalogue in one coordinate"),
        Column("rms_catalogue_2d", "float64", "mas", "rms separation from the catalogue"),
    ),
    key=("source_id",),
)

# Error of mean positions against the number of orbits averaged.
ERRORS_BY_COUNT = Table(
    "errors_by_count",
    (
        Column("n_orbits", "int64", "", "number of orbits averaged, N"),
        Column("n_sources", "int64", "", "number of sources with at least N orbits"),
        Column("error_mas", "float64", "mas", "rms error in one coordinate, RA and Dec pooled"),
        Column("error_low_mas", "float64", "mas", "error_mas less its sigma"),
        Column("error_high_mas", "float64", "mas", "error_mas plus its sigma"),
        Column("expected_mas", "float64", "mas", "expected error, from noise and floor"),
        Column(
            "noise_mas", "float64", "mas", "expected error from noise, which falls as 1/sqrt(N)"
        ),
        Column(
            "floor_mas", "float64", "mas", "expected error from the catalogue, common to all orbits"
        ),
    ),
    key=("n_orbits",),
)

# One row per orbit of a run; numbers are missing if the orbit failed or is not fitted yet.
RUN_ORBITS = Table(
    "orbits",
    (
        _ORBIT,
        Column("status", "str", "", "complete, failed or missing"),
        Column("message", "str", "", "why the fit failed; empty otherwise"),
        Column("state", "str", "", "of the verdict: good, warn or bad; empty without one"),
        *(
            Column(name, "float64", unit, meaning, may_be_nan=True)
            for name, unit, meaning in (
                ("epoch", "d", "mean epoch of the orbit, MJD in TCB"),
                ("converged", "", "1 where the fit converged, else 0"),
                ("iterations", "", "iterations of the fit"),
                ("n_measurements", "", "number of measurements"),
                ("n_sources", "", "number of measured sources"),
                ("n_reference", "", "number of measured reference sources"),
                ("chi2_per_dof", "", "chi2 over the effective degrees of freedom"),
                ("dof", "", "effective degrees of freedom"),
                ("residual_rms_x", "pix", "rms residual in x"),
                ("residual_rms_y", "pix", "rms residual in y"),
                (
                    "normalised_deviation_ra",
                    "",
                    "normalised deviation of the reference sources, alpha*",
                ),
                (
                    "normalised_deviation_dec",
                    "",
                    "normalised deviation of the reference sources, delta",
                ),
                ("expected_normalised_deviation_ra", "", "expected normalised deviation, alpha*"),
                ("expected_normalised_deviation_dec", "", "expected normalised deviation, delta"),
                ("normalised_deviation_dof_ra", "", "its degrees of freedom, alpha*"),
                ("normalised_deviation_dof_dec", "", "its degrees of freedom, delta"),
                ("mean_error_ra", "mas", "sigma of the mean error of the other sources, alpha*"),
                ("mean_error_dec", "mas", "sigma of the mean error of the other sources, delta"),
                ("seconds", "s", "time from reading to writing"),
            )
        ),
    ),
    key=("orbit_id",),
)
