"""Tables with a row per source: deviation from the truth, and uncertainty."""

import numpy as np
import pandas as pd

from plateviz.tables.labels import id_strings
from solver.data.instrument import Instrument
from solver.data.result import FitResult
from solver.model.directions import offsets_mas
from solver.units import RAD_PER_MAS

REFERENCE = "reference"
NON_REFERENCE = "non-reference"
ARTIFICIAL = "artificial"
CLASSES = (NON_REFERENCE, ARTIFICIAL, REFERENCE)
KINDS = ("marginal", "conditional")

_DEVIATION_COLUMNS = [
    "source_id",
    "id",
    "source_class",
    "n_obs",
    "deviation_ra_mas",
    "deviation_dec_mas",
    "sigma_ra_mas",
    "sigma_dec_mas",
    "corr",
    "pull_ra",
    "pull_dec",
]


def ordered_by_class(sources: pd.DataFrame) -> pd.DataFrame:
    """Return the sources with a `source_class`, in the order of `CLASSES`, then of id."""
    names = class_names(sources)
    order = np.lexsort((sources["source_id"], pd.Index(CLASSES).get_indexer(names)))
    return sources.iloc[order].reset_index(drop=True).assign(source_class=names[order])


def class_names(sources: pd.DataFrame) -> np.ndarray:
    """Return the class of each source; one flagged both ways counts as reference."""
    flags = [sources["is_reference"].to_numpy(bool), sources["is_artificial"].to_numpy(bool)]
    return np.select(flags, [REFERENCE, ARTIFICIAL], NON_REFERENCE).astype(object)


def chi2_per_dof(table: pd.DataFrame) -> np.ndarray:
    """Return `chi2` over `dof` of sources or exposures; NaN where nothing is left to judge."""
    dof = table["dof"].to_numpy(dtype=float)
    return table["chi2"].to_numpy() / np.where(dof > 0, dof, np.nan)


def deviation(result: FitResult, truth: pd.DataFrame | None) -> pd.DataFrame:
    """Return estimated minus true position of each source with a known truth.

    Parameters
    ----------
    result : the fit
    truth : `source_id`, `ra`, `dec` (deg, at the mean epoch, no aberration), or None

    Returns
    -------
    `source_id`, `id`, `source_class`, `n_obs`, `deviation_ra_mas` (ra cos(dec)),
    `deviation_dec_mas`, the marginal `sigma_ra_mas`, `sigma_dec_mas`, `corr`, and
    `pull_ra`, `pull_dec` (deviation over marginal sigma); no rows without a truth
    """
    if truth is None:
        return pd.DataFrame(columns=_DEVIATION_COLUMNS)
    true = truth[["source_id", "ra", "dec"]].rename(columns={"ra": "ra_true", "dec": "dec_true"})
    table = ordered_by_class(result.sources).merge(true, on="source_id", validate="one_to_one")
    d_ra, d_dec = offsets_mas(table["ra"], table["dec"], table["ra_true"], table["dec_true"])
    return table.assign(
        id=id_strings(table["source_id"]),
        deviation_ra_mas=d_ra,
        deviation_dec_mas=d_dec,
        sigma_ra_mas=table["sigma_ra_marginal"],
        sigma_dec_mas=table["sigma_dec_marginal"],
        corr=table["corr_marginal"],
        pull_ra=d_ra / table["sigma_ra_marginal"],
        pull_dec=d_dec / table["sigma_dec_marginal"],
    )[_DEVIATION_COLUMNS]


def deviation_statistics(table: pd.DataFrame) -> pd.DataFrame:
    """Return the summary of a table of `deviation`, a row per class in it.

    Returns
    -------
    `source_class`, `n`, mean, rms and rms pull (1 is expected) in each coordinate,
    and the mean marginal covariance: `var_ra`, `var_dec`, `cov` (mas^2)
    """
    squares = table.assign(
        square_ra=table["deviation_ra_mas"] ** 2,
        square_dec=table["deviation_dec_mas"] ** 2,
        pull_square_ra=table["pull_ra"] ** 2,
        pull_square_dec=table["pull_dec"] ** 2,
        var_ra=table["sigma_ra_mas"] ** 2,
        var_dec=table["sigma_dec_mas"] ** 2,
        cov=table["corr"] * table["sigma_ra_mas"] * table["sigma_dec_mas"],
    )
    groups = squares.groupby("source_class", sort=False)
    mean = groups[list(_MEANS)].mean().rename(columns=_MEANS).astype(float)
    roots = ["rms_ra", "rms_dec", "pull_rms_ra", "pull_rms_dec"]
    mean[roots] = np.sqrt(mean[roots])
    mean.insert(0, "n", groups.size().astype("int64"))
    return mean.reset_index()


_MEANS = {
    "deviation_ra_mas": "mean_ra",
    "deviation_dec_mas": "mean_dec",
    "square_ra": "rms_ra",
    "square_dec": "rms_dec",
    "pull_square_ra": "pull_rms_ra",
    "pull_square_dec": "pull_rms_dec",
    "var_ra": "var_ra",
    "var_dec": "var_dec",
    "cov": "cov",
}


def uncertainty(result: FitResult, instrument: Instrument) -> pd.DataFrame:
    """Return conditional and marginal uncertainties against the number of measurements.

    Parameters
    ----------
    result : the fit
    instrument : of the fit; gives pitch and focal length for the square-root law

    Returns
    -------
    A row per source, kind and coordinate: `source_id`, `id`, `source_class`, `kind`
    ("marginal" or "conditional"), `coordinate` ("ra" or "dec"), `n_obs`, `sigma_mas`, and
    `sigma_single_mas`, the median uncertainty of one measurement on the sky
    """
    table = ordered_by_class(result.sources)
    single, ids = _sigma_single_mas(result, instrument), id_strings(table["source_id"])
    frames = [
        pd.DataFrame(
            {
                "source_id": table["source_id"],
                "id": ids,
                "source_class": table["source_class"],
                "kind": kind,
                "coordinate": coordinate,
                "n_obs": table["n_obs"],
                "sigma_mas": table[f"sigma_{coordinate}_{kind}"],
                "sigma_single_mas": single,
            }
        )
        for coordinate in ("ra", "dec")
        for kind in KINDS
    ]
    return pd.concat(frames, ignore_index=True)


def uncertainty_by_count(table: pd.DataFrame) -> pd.DataFrame:
    """Return the median and the 16th and 84th percentile of `uncertainty` per n_obs.

    Used when there are too many sources to draw one by one.

    Returns
    -------
    `source_class`, `kind`, `coordinate`, `n_obs`, `n` (sources), `low`, `sigma_mas`
    (median) and `high`, mas
    """
    groups = table.groupby(["source_class", "kind", "coordinate", "n_obs"], sort=False)
    levels = groups["sigma_mas"].quantile([0.16, 0.5, 0.84]).unstack()
    levels.columns = ["low", "sigma_mas", "high"]
    return levels.assign(n=groups.size()).reset_index()


def _sigma_single_mas(result: FitResult, instrument: Instrument) -> float:
    # x and y are pooled, because the mounting angles and the roll differ: the square-root law
    # takes one uncertainty per measurement for both coordinates.
    residuals = result.residuals
    pitch = np.array([(d.pitch_x_um, d.pitch_y_um) for d in instrument.detectors])
    number = instrument.index_of(residuals["detector_id"].to_numpy())
    sigma_um = np.concatenate(
        [residuals[name].to_numpy() * pitch[number, i] for i, name in enumerate(("sx", "sy"))]
    )
    single = float(np.median(sigma_um)) if len(sigma_um) else float("nan")
    return single / instrument.focal_length_um / RAD_PER_MAS
