"""A synthetic fitted orbit, made with NumPy: no fit is run."""

import shutil
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from plateviz.cli.main import main
from solver.data import eigenmode_schema as eigenmode_schema
from solver.data import schema
from solver.data.instrument import MINI_MOCK
from solver.data.parameters import CALIBRATION_GROUPS, Group
from solver.data.result import FitResult, FitStatus
from solver.data.settings import FitSettings
from solver.simulate.settings import SurveySettings
from solver.simulate.survey import simulate_survey
from tests.fitting import fitting_in_this_process
from tests.plateviz.survey_tables import SurveySample, synthetic_survey

FIRST_ID = 4_057_482_027_171_038_209
N_SOURCES, N_FIELDS, N_PLATES, ORDER = 300, 4, 3, 5
CENTRE = (266.13, -29.14)
NOISE_PIX = 0.01
SINGLE_MAS = NOISE_PIX * 10.0 / MINI_MOCK.focal_length_um * np.degrees(1.0) * 3.6e6


@pytest.fixture(scope="session")
def instrument():
    """The instrument of the synthetic orbit."""
    return MINI_MOCK


@pytest.fixture(scope="session")
def make_fit_result() -> Callable[[int], tuple[FitResult, pd.DataFrame]]:
    """Return the function that makes a synthetic result and its truth from a seed."""
    return synthetic_fit


@pytest.fixture(scope="session")
def fit_result() -> FitResult:
    """About 300 sources, 12 exposures, 4 detectors; every table of `solver.data.schema`."""
    return synthetic_fit(1)[0]


@pytest.fixture(scope="session")
def made_survey(tmp_path_factory) -> Path:
    """A simulated survey of three orbits."""
    directory = tmp_path_factory.mktemp("surveys") / "made"
    simulate_survey(directory, SurveySettings(orbits=3, seed=3).scaled(6_000))
    return directory


@pytest.fixture
def run(monkeypatch, capsys):
    """Return the function that runs the command line: exit code, standard output and error."""

    def call(*arguments):
        monkeypatch.setattr(sys, "argv", ["plateviz", *map(str, arguments)])
        with pytest.raises(SystemExit) as ended:
            main()
        printed = capsys.readouterr()
        return ended.value.code or 0, printed.out, printed.err

    return call


@pytest.fixture
def without_workers():
    """Fit the orbits of a survey in the process of the test."""
    with fitting_in_this_process():
        yield


@pytest.fixture
def survey_folder(made_survey, tmp_path) -> Path:
    """A private copy of the survey, without any run."""
    return Path(shutil.copytree(made_survey, tmp_path / "survey"))


@pytest.fixture(scope="module")
def fitted_survey(made_survey, tmp_path_factory) -> Path:
    """A copy of the survey, shared by the tests of one module."""
    return Path(shutil.copytree(made_survey, tmp_path_factory.mktemp("runs") / "survey"))


@pytest.fixture(scope="session")
def compared(fit_result) -> FitResult:
    """The fit with all orders compared: order 5 is best by evidence, order 6 by prediction."""
    order = np.arange(10)
    misfit = 10.0 ** (5 - order.clip(max=5)) - 1.0
    terms = np.array([0, 0, 6, 14, 24, 36, 50, 66, 84, 104])
    orders = pd.DataFrame(
        {
            "order": order,
            "n_terms": terms,
            "converged": True,
            "chi2": 70_000.0 * (1.0 + 1e-3 * misfit),
            "dof": 70_000.0 - terms,
            "effective_parameters": 1900.0 + terms,
            "log_evidence": 2e5 - 10.0 * misfit - 5.0 * (order - 5).clip(min=0),
            "n_reserved": 24,
            "held_out_chi2": 7000.0 * (1.0 + 1e-3 * misfit),
            "held_out_dof": 7000,
            "held_out_log_density": 2e4 - misfit - 0.5 * np.abs(order - 6),
        }
    )
    return replace(fit_result, orders=orders[schema.ORDERS.names])


@pytest.fixture(scope="session")
def truth() -> pd.DataFrame:
    """True directions of the sources of `fit_result` at its mean epoch."""
    return synthetic_fit(1)[1]


def synthetic_fit(seed: int = 1, n_sources: int = N_SOURCES) -> tuple[FitResult, pd.DataFrame]:
    """Return a result with realistic statistics, and the truth about which it scatters."""
    random = np.random.default_rng(seed)
    exposures, pointings = _exposures(random)
    truth = _truth(n_sources)
    residuals = _residuals(random, truth, exposures, pointings)
    truth = truth[truth["source_id"].isin(residuals["source_id"])].reset_index(drop=True)
    counts = residuals.groupby("source_id").size()
    sources = _sources(random, truth, counts, residuals)
    chi2 = _chi2(residuals)
    exposures = _with_chi2(exposures, residuals, chi2)
    result = FitResult(
        sources=sources,
        residuals=residuals,
        calibration=_calibration(random, pointings, exposures),
        exposures=exposures,
        trace=_trace(len(residuals)),
        summary=_summary(sources, residuals, exposures, float(chi2.sum())),
        settings=FitSettings(order=ORDER),
        instrument=MINI_MOCK,
        true_places=truth[["source_id", "ra", "dec"]].assign(induced_ra=0.02, induced_dec=-0.01),
    )
    result = replace(result, **_eigenmodes(random, result))
    return result, truth[["source_id", "ra", "dec"]]


def _exposures(random: np.random.Generator) -> tuple[pd.DataFrame, pd.DataFrame]:
    index = np.arange(N_FIELDS * N_PLATES)
    field = index // N_PLATES
    exposures = pd.DataFrame(
        {
            "orbit_id": np.full(len(index), 7),
            "field_id": field,
            "plate_id": index % N_PLATES,
            "obstime": 61822.0 + 2e-3 * index,
        }
    )
    jitter = random.normal(0.0, 1e-3, (2, len(index)))
    pointings = pd.DataFrame(
        {
            "pointing_ra": CENTRE[0] + np.array([0.115, -0.12, -0.07, 0.07])[field] + jitter[0],
            "pointing_dec": CENTRE[1] + np.array([-0.06, 0.065, -0.10, 0.10])[field] + jitter[1],
            "position_angle": -58.5 + random.normal(0.0, 1e-3, len(index)),
            "focal_length": MINI_MOCK.focal_length_um + random.normal(0.0, 50.0, len(index)),
        }
    )
    return exposures, pointings


def _truth(n_sources: int) -> pd.DataFrame:
    # A separate seed, so that two fits of the same orbit share the truth.
    random = np.random.default_rng(100)
    kind = np.arange(n_sources)
    return pd.DataFrame(
        {
            "source_id": FIRST_ID + 977 * kind,
            "ra": CENTRE[0] + random.uniform(-0.38, 0.38, n_sources),
            "dec": CENTRE[1] + random.uniform(-0.33, 0.33, n_sources),
            "is_reference": kind % 5 == 0,
            "is_artificial": kind % 15 == 7,
        }
    )


def _ideal_um(truth: pd.DataFrame, pointing: pd.Series) -> np.ndarray:
    """Eq. (method:projection) and Eq. (method:ideal), by trigonometry."""
    ra, dec = np.radians(truth["ra"].to_numpy()), np.radians(truth["dec"].to_numpy())
    ra_0, dec_0 = np.radians(pointing["pointing_ra"]), np.radians(pointing["pointing_dec"])
    cos_r = np.sin(dec_0) * np.sin(dec) + np.cos(dec_0) * np.cos(dec) * np.cos(ra - ra_0)
    xi = np.cos(dec) * np.sin(ra - ra_0) / cos_r
    eta = np.sin(dec) * np.cos(dec_0) - np.sin(dec_0) * np.cos(dec) * np.cos(ra - ra_0)
    angle = np.radians(pointing["position_angle"])
    turn = np.array([(np.cos(angle), np.sin(angle)), (-np.sin(angle), np.cos(angle))])
    return pointing["focal_length"] * (turn @ np.array([-xi, eta / cos_r])).T


def _residuals(
    random: np.random.Generator,
    truth: pd.DataFrame,
    exposures: pd.DataFrame,
    pointings: pd.DataFrame,
) -> pd.DataFrame:
    frames = []
    for row, pointing in zip(exposures.itertuples(), pointings.iloc, strict=True):
        ideal = _ideal_um(truth, pointing)
        for detector in MINI_MOCK.detectors:
            angle = np.radians(detector.rotation_deg)
            turn = np.array([(np.cos(angle), -np.sin(angle)), (np.sin(angle), np.cos(angle))])
            pixel = (ideal - (detector.x_um, detector.y_um)) @ turn.T / detector.pitch_x_um
            on = (np.abs(pixel) < 0.5 * detector.n_x).all(axis=1)
            frames.append(
                pd.DataFrame(
                    {
                        "orbit_id": row.orbit_id,
                        "field_id": row.field_id,
                        "plate_id": row.plate_id,
                        "detector_id": detector.detector_id,
                        "source_id": truth["source_id"][on],
                        "model_x": pixel[on, 0],
                        "model_y": pixel[on, 1],
                        "ideal_x": ideal[on, 0],
                        "ideal_y": ideal[on, 1],
                        "focal_x": ideal[on, 0],
                        "focal_y": ideal[on, 1],
                    }
                )
            )
    table = pd.concat(frames, ignore_index=True)
    n = len(table)
    leverage = random.uniform(0.1, 0.3, n)
    scatter = NOISE_PIX * np.sqrt(1.0 - 0.5 * leverage)
    for axis in "xy":
        standardised = random.normal(0.0, 1.0, n)
        table[f"s{axis}"] = NOISE_PIX
        table[f"standardised_{axis}"] = standardised
        table[f"residual_{axis}"] = scatter * standardised
        table[f"n{axis}"] = table[f"model_{axis}"] + table[f"residual_{axis}"]
    table["leverage"] = leverage
    return table[schema.RESIDUALS.names]


def _sources(
    random: np.random.Generator, truth: pd.DataFrame, counts: pd.Series, residuals: pd.DataFrame
) -> pd.DataFrame:
    n = len(truth)
    table = truth.copy()
    table["n_obs"] = table["source_id"].map(counts)
    prior = np.where(table["is_reference"], random.uniform(0.1, 0.4, n), 400.0)
    conditional = 1.0 / np.sqrt(table["n_obs"] / SINGLE_MAS**2 + prior**-2.0)
    correlation = random.uniform(-0.3, 0.3, n)
    for coordinate, factor in (("ra", 1.0), ("dec", 0.93)):
        marginal = (
            np.minimum(np.hypot(random.uniform(1.02, 1.2, n) * conditional, 0.05), prior) * factor
        )
        cos = np.cos(np.radians(truth["dec"])) if coordinate == "ra" else 1.0
        off_prior, off_truth = random.normal(0.0, prior), random.normal(0.0, marginal)
        table[f"sigma_{coordinate}_conditional"] = conditional * factor
        table[f"sigma_{coordinate}_marginal"] = marginal
        table[f"prior_sigma_{coordinate}"] = prior
        table[f"prior_{coordinate}"] = truth[coordinate] + off_prior / 3.6e6 / cos
        table[coordinate] = truth[coordinate] + off_truth / 3.6e6 / cos
        table[f"offset_{coordinate}"] = off_truth - off_prior
    table["corr_conditional"] = table["prior_corr"] = 0.0
    table["corr_marginal"] = correlation
    table["prior_pmra"], table["prior_pmdec"] = random.normal(0.0, 5.0, (2, n))
    table["magnitude"] = random.uniform(10.0, 18.0, n)
    weight = 1.0 - 0.5 * residuals["leverage"]
    table["chi2"] = table["source_id"].map(_chi2(residuals).groupby(residuals["source_id"]).sum())
    table["dof"] = table["source_id"].map((2.0 * weight).groupby(residuals["source_id"]).sum())
    return table.sort_values("source_id")[schema.SOURCES.names].reset_index(drop=True)


def _chi2(residuals: pd.DataFrame) -> pd.Series:
    return (residuals["residual_x"] / residuals["sx"]) ** 2 + (
        residuals["residual_y"] / residuals["sy"]
    ) ** 2


def _with_chi2(exposures: pd.DataFrame, residuals: pd.DataFrame, chi2: pd.Series) -> pd.DataFrame:
    keys = ["orbit_id", "field_id", "plate_id"]
    sums = residuals.assign(chi2=chi2, dof=2.0 - residuals["leverage"]).groupby(keys)
    added = sums.agg(n_obs=("chi2", "size"), chi2=("chi2", "sum"), dof=("dof", "sum"))
    return exposures.merge(added.reset_index(), on=keys)[schema.EXPOSURES.names]


def _values(group: Group, pointings: pd.DataFrame, random: np.random.Generator) -> np.ndarray:
    if group.name in pointings:
        return pointings[group.name].to_numpy()
    if group.axis == "coef":
        degrees = [d for d in range(2, ORDER + 1) for _ in range(d + 1)]
        return random.normal(0.0, 1.0, len(degrees)) * 2.0 ** (3 - np.array(degrees))
    if group.centre_from == "instrument":
        return np.array([getattr(d, group.column) for d in MINI_MOCK.detectors])
    return np.zeros(len(pointings if group.axis == "exp" else MINI_MOCK.detectors))


def _calibration(
    random: np.random.Generator, pointings: pd.DataFrame, exposures: pd.DataFrame
) -> pd.DataFrame:
    pairs = [(d - k, k) for d in range(2, ORDER + 1) for k in range(d + 1)]
    letters = {"distortion_x": "A", "distortion_y": "B"}
    labels = {
        "exp": [f"field {f} plate {p}" for f, p in exposures[["field_id", "plate_id"]].to_numpy()],
        "det": [f"detector {d.detector_id}" for d in MINI_MOCK.detectors],
    }
    frames = []
    for group in CALIBRATION_GROUPS:
        value = _values(group, pointings, random)
        names = labels.get(group.axis) or [
            f"{letters.get(group.name, group.name)}({k},{n})" for k, n in pairs
        ]
        frames.append(
            pd.DataFrame(
                {
                    "group": group.name,
                    "element": np.arange(len(value)),
                    "label": names,
                    "value": value,
                    "prior_centre": value,
                    "value_unit": group.value_unit,
                    "offset": 0.0,
                    "prior_sigma": group.width,
                    "sigma_conditional": 0.01,
                    "sigma_marginal": 0.02,
                    "unit": group.unit,
                    "prior_share": 0.001,
                }
            )
        )
    return pd.concat(frames, ignore_index=True)[schema.CALIBRATION.names]


def _trace(n: int) -> pd.DataFrame:
    objective = np.array([3.2e9, 4.1e5, 2.02 * n, 2.0 * n])
    return pd.DataFrame(
        {
            "iteration": np.arange(4),
            "objective": objective,
            "chi2": 0.98 * objective,
            "largest_step": [np.nan, 5.3e4, 12.0, 2.1e-4],
            "largest_parameter": ["", "pointing RA, field 1 plate 2", "A(2,0)", "B(3,1)"],
            "damping": 0.0,
            "seconds": [0.1, 0.6, 1.1, 1.6],
        }
    )


def _summary(
    sources: pd.DataFrame, residuals: pd.DataFrame, exposures: pd.DataFrame, chi2: float
) -> dict[str, object]:
    dof = float(exposures["dof"].sum())
    return {
        "converged": True,
        "reason": FitStatus.CONVERGED.value,
        "engine": "gauss-newton",
        "order": ORDER,
        "iterations": 3,
        "n_measurements": len(residuals),
        "n_sources": len(sources),
        "n_reference": int(sources["is_reference"].sum()),
        "n_exposures": len(exposures),
        "chi2": chi2,
        "dof": dof,
        "chi2_per_dof": chi2 / dof,
        "effective_parameters": 2.0 * len(residuals) - dof,
        "normalised_deviation_ra": 0.34,
        "normalised_deviation_dec": 0.31,
        "expected_normalised_deviation_ra": 0.33,
        "expected_normalised_deviation_dec": 0.33,
        "residual_rms_x": float(np.sqrt(np.mean(residuals["residual_x"] ** 2))),
        "residual_rms_y": float(np.sqrt(np.mean(residuals["residual_y"] ** 2))),
        "seconds": {"read": 0.3, "prepare": 0.2, "fit": 1.6, "write": 0.1},
        "epoch_mjd": float(exposures["obstime"].mean()),
        "mean_error_ra": 0.041,
        "mean_error_dec": 0.040,
    }


WEAK_NAMES = ["common detector x with common pointing RA", "common position angle", "common Dec"]


def _eigenmodes(random: np.random.Generator, result: FitResult) -> dict[str, pd.DataFrame]:
    """Three weak directions: constrained by a prior, by the reference sources, and by both."""
    calibration, ids = result.calibration, result.sources["source_id"].to_numpy()
    count, weak = len(calibration), len(WEAK_NAMES)
    names = pd.Series([*WEAK_NAMES, *[""] * (count - weak)], dtype="str")
    data = np.r_[0.0, 0.0, 0.25, np.linspace(0.6, 1.0, count - weak)]
    of_calibration = np.r_[1.0, 0.0, 0.5, np.zeros(count - weak)]
    modes = pd.DataFrame(
        {
            "mode": np.arange(1, count + 1),
            "name": names,
            "data_share": data,
            "reference_share": 1.0 - data - of_calibration,
            "source_share": 0.0,
            "calibration_share": of_calibration,
            "relative_information": np.geomspace(1e-11, 1.0, count),
        }
    )
    share = random.dirichlet(np.full(count, 0.1), weak)
    is_x = (calibration["group"] == "detector_x").to_numpy()
    parameters = pd.concat(
        [
            calibration[["group", "element", "label", "unit"]].assign(
                mode=mode + 1,
                move=np.sqrt(share[mode]),
                share=share[mode],
                prior_share=of_calibration[mode] * is_x / is_x.sum(),
            )
            for mode in range(weak)
        ],
        ignore_index=True,
    )
    shifts = pd.DataFrame(
        {
            "mode": np.repeat(np.arange(1, weak + 1), len(ids)),
            "source_id": np.tile(ids, weak),
            "shift_ra": np.repeat([1e-4, 0.04, 0.03], len(ids)),
            "shift_dec": np.repeat([0.0, -0.01, 0.03], len(ids)),
        }
    )
    tables = (modes, parameters, shifts)
    return {
        t.name: f[t.names] for t, f in zip(eigenmode_schema.EIGENMODE_TABLES, tables, strict=True)
    }


@pytest.fixture(scope="session")
def survey() -> SurveySample:
    """A fitted survey of 90 orbits and 72 sources, with the columns of `survey_schema`."""
    return synthetic_survey()
