"""A small orbit as raw tables and files, and a small result, for the tests of solver.io."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
from astropy.io import fits
from astropy.table import Table

from solver.data.instrument import MINI_MOCK
from solver.data.parameters import CALIBRATION_GROUPS
from solver.data.result import FitResult
from solver.data.schema import CALIBRATION, EXPOSURES, RESIDUALS, SOURCES, TRACE, TRUE_PLACES
from solver.data.settings import FitSettings

FIRST_ID = 4057000000000003911
N_SOURCES = 6
N_EXPOSURES = 4
ELEMENTS = {"exp": N_EXPOSURES, "coef": 18, "det": 4}


def measurement(orbit=1, seed=0):
    """Return the raw measurement table, with every source once per exposure."""
    rng = np.random.default_rng(seed)
    exposure = np.repeat(np.arange(N_EXPOSURES), N_SOURCES)
    n = exposure.size
    table = Table(
        {
            "orbit_id": np.full(n, orbit),
            "field_id": exposure // 2,
            "plate_id": exposure % 2,
            "detector_id": np.tile(np.arange(N_SOURCES) % 4, N_EXPOSURES),
            "source_id": np.tile(FIRST_ID + np.arange(N_SOURCES), N_EXPOSURES),
            "nx": rng.uniform(-960, 960, n),
            "ny": rng.uniform(-960, 960, n),
            "sx": rng.uniform(0.005, 0.01, n),
            "sy": rng.uniform(0.005, 0.01, n),
        }
    )
    for name in ("nx", "ny", "sx", "sy"):
        table[name].unit = "pix"
    return table


def environment(orbit=1):
    """Return the raw environment table."""
    exposure = np.arange(N_EXPOSURES)
    table = Table(
        {
            "orbit_id": np.full(N_EXPOSURES, orbit),
            "field_id": exposure // 2,
            "plate_id": exposure % 2,
            "obstime": 61822.0 + exposure / 4320.0,
            "ra_est": 266.2 + 1e-4 * exposure,
            "dec_est": -29.2 + 1e-4 * exposure,
            "pa_est": np.full(N_EXPOSURES, -58.5),
            "focal_length": np.full(N_EXPOSURES, 4.86e6),
        }
    )
    for name, unit in (("obstime", "d"), ("focal_length", "um")):
        table[name].unit = unit
    for name in ("ra_est", "dec_est", "pa_est"):
        table[name].unit = "deg"
    return table


def catalogue(seed=1):
    """Return the raw catalogue: measured sources and one more; the first two are references."""
    rng = np.random.default_rng(seed)
    n = N_SOURCES + 1
    table = Table(
        {
            "source_id": FIRST_ID + np.arange(n),
            "ra": 266.2 + rng.uniform(-0.2, 0.2, n),
            "dec": -29.2 + rng.uniform(-0.2, 0.2, n),
            "ra_error": rng.uniform(0.05, 0.1, n),
            "dec_error": rng.uniform(0.05, 0.1, n),
            "pmra": rng.normal(0, 3, n),
            "pmdec": rng.normal(0, 3, n),
            "pmra_error": rng.uniform(0.05, 0.1, n),
            "pmdec_error": rng.uniform(0.05, 0.1, n),
            "parallax": rng.uniform(0.1, 1, n),
            "ref_epoch": np.full(n, 2016.0),
            "is_reference": np.arange(n) < 2,
        }
    )
    for name in ("ra", "dec"):
        table[name].unit = "deg"
    for name in ("ra_error", "dec_error", "parallax"):
        table[name].unit = "mas"
    for name in ("pmra", "pmdec", "pmra_error", "pmdec_error"):
        table[name].unit = "mas / yr"
    table["ref_epoch"].unit = "yr"
    return table


def write_fits(path: Path, **tables: Table) -> Path:
    """Write tables as HDUs of one FITS file with checksums."""
    hdus = fits.HDUList([fits.PrimaryHDU()])
    for name, table in tables.items():
        hdu = fits.table_to_hdu(table)
        hdu.name = name
        hdus.append(hdu)
    hdus.writeto(path, checksum=True, overwrite=True)
    return path


def write_table(table: Table, path: Path) -> Path:
    """Write one table in the format given by the suffix of `path`."""
    formats = {".ecsv": "ascii.ecsv", ".csv": "ascii.csv", ".xml": "votable"}
    table.write(path, format=formats.get(path.suffix, path.suffix[1:]), overwrite=True)
    return path


def write_orbit(folder: Path, measured=None, exposed=None, listed=None) -> tuple[Path, Path]:
    """Write OBS.fits and REF.fits, with given tables instead of the default; return both paths."""
    obs = write_fits(
        folder / "OBS.fits",
        measurement=measurement() if measured is None else measured,
        environment=environment() if exposed is None else exposed,
    )
    ref = write_fits(folder / "REF.fits", catalogue=catalogue() if listed is None else listed)
    return obs, ref


def small_result(seed=2) -> FitResult:
    """Return a result with the right columns and random values."""
    rng = np.random.default_rng(seed)
    measured, exposed = measurement().to_pandas(), environment().to_pandas()
    sources = random_table(SOURCES, N_SOURCES, rng).assign(
        source_id=FIRST_ID + np.arange(N_SOURCES),
        is_reference=np.arange(N_SOURCES) < 2,
        dec=-29.2 + rng.uniform(-0.2, 0.2, N_SOURCES),
    )
    residuals = random_table(RESIDUALS, len(measured), rng)
    residuals = residuals.assign(**{c: measured[c] for c in measured if c in residuals})
    residuals.loc[3, "standardised_x"] = np.nan
    exposures = random_table(EXPOSURES, N_EXPOSURES, rng)
    exposures = exposures.assign(**{c: exposed[c] for c in exposed if c in exposures})
    trace = random_table(TRACE, 3, rng).assign(
        iteration=np.arange(3), largest_parameter=["", "pitch_x detector 3", "µ Å "]
    )
    trace.loc[0, "largest_step"] = np.nan
    return FitResult(
        sources=sources,
        residuals=residuals,
        calibration=_calibration(rng),
        exposures=exposures,
        trace=trace,
        summary={
            "converged": True,
            "reason": "the astronomer's reason & more &",
            "iterations": np.int64(3),
            "chi2_per_dof": 0.1 + 0.2,
            "log_evidence": None,
            "seconds": {"read": 0.25, "fit": 1e-17},
            "truth": {},
        },
        settings=FitSettings(order=5, prior_widths={"focal_length": float("inf"), "sources": 2.0}),
        provenance={"OBS.fits": "ab" * 32, "a long name, it's é.fits" * 4: "cd" * 32},
        instrument=replace(MINI_MOCK, name='the astronomer\'s "camera" µ'),
        true_places=random_table(TRUE_PLACES, 4, rng),
    )


def without_truth(result: FitResult) -> FitResult:
    """Return the result as fitted without a truth."""
    return replace(result, true_places=None)


def _calibration(rng: np.random.Generator) -> pd.DataFrame:
    parts = [
        random_table(CALIBRATION, ELEMENTS[group.axis], rng).assign(
            group=group.name,
            element=np.arange(ELEMENTS[group.axis]),
            value_unit=group.value_unit,
            unit=group.unit,
            prior_sigma=np.inf,
        )
        for group in CALIBRATION_GROUPS
    ]
    return pd.concat(parts, ignore_index=True)


def random_table(table, rows, rng) -> pd.DataFrame:
    makers = {
        "int64": lambda: FIRST_ID + rng.integers(0, 10**6, rows),
        "float64": lambda: rng.normal(size=rows),
        "bool": lambda: rng.random(rows) < 0.5,
        "str": lambda: [f"label {i}" for i in range(rows)],
    }
    return pd.DataFrame({column.name: makers[column.dtype]() for column in table})
