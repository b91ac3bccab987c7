"""`open` and `simulate`: open a survey, an orbit or a solution from paths, or make a survey."""

from collections.abc import Iterable
from os import PathLike
from pathlib import Path

from plateviz.notebook.lazy_solver import LazySolver, run_job
from plateviz.notebook.orbit import OpenOrbit
from plateviz.notebook.report import path_of
from plateviz.notebook.solution import OpenSolution
from plateviz.notebook.survey import OpenSurvey
from plateviz.runs.kept_solutions import (
    kept_solution,
    simulation_of_kept,
    survey_instrument_of,
)
from plateviz.solving.job import Job
from plateviz.solving.origin import OrbitFiles
from plateviz.tables.counts import orbits_text
from solver.errors import InputError
from solver.io.atomic import sha256_of
from solver.io.result import read_result
from solver.io.result_instrument import instrument_of
from solver.io.survey_header import HEADER, read_header, section
from solver.simulate.settings import SurveySettings

_Path = str | PathLike[str]


def open(
    path: _Path,
    reference: _Path | None = None,
    *,
    truth: _Path | None = None,
    instrument: _Path | None = None,
    orbit: int | None = None,
    run: str | None = None,
) -> OpenSurvey | OpenOrbit | OpenSolution:
    """Open a survey, the files of an orbit, or a solution.

    Parameters
    ----------
    path : a survey directory, a result file of `plateviz fit`, a solution that was kept in the
        dashboard (`DIR/solutions/NAME`), or, with `reference`, the measurements and exposures of
        an orbit, as for `plateviz fit`
    reference : the reference catalogue of the measurements
    truth : the true catalogue of a simulation; accepted only with the files of an orbit
    instrument : a TOML file, with measurements or a solution; the mini-mock's by default
    orbit : id of the orbit, with measurements of several orbits
    run : name of a run of the survey; the first complete run by default

    Returns
    -------
    A survey, an orbit, or a solution.

    Raises
    ------
    InputError
        If a file is missing or invalid, or an argument does not apply to `path`.
    """
    given = {"truth": truth, "instrument": instrument, "orbit": orbit, "run": run}
    given_names = {name for name, value in given.items() if value is not None}
    if reference is not None:
        _refuse(given_names & {"run"}, "the files of an orbit")
        return _open_orbit(path, reference, truth, instrument, orbit)
    target = _existing_path(path)
    if (kept := kept_solution(target)) is not None:
        _refuse(given_names - {"instrument"}, "a kept solution")
        result = kept.read()
        camera = instrument_of(result, _given(instrument), survey_instrument_of(kept))
        return OpenSolution(
            result,
            camera,
            kept.name,
            f"plateviz.open({str(target)!r})",
            simulation=simulation_of_kept(kept),
        )
    if target.is_dir():
        _refuse(given_names - {"run"}, "a survey directory")
        return OpenSurvey(target, run)
    _refuse(given_names - {"instrument"}, "a result file; measurements need a reference catalogue")
    result = read_result(target)
    camera = instrument_of(result, _given(instrument))
    return OpenSolution(result, camera, target.name, f"plateviz.open({str(target)!r})")


def simulate(
    directory: _Path,
    *,
    orbits: int = 100,
    seed: int = 0,
    stars: int | None = None,
    catalogue: _Path | None = None,
    defects: Iterable[str] = (),
    magnitudes: bool = False,
    noise_by_magnitude: bool = False,
) -> OpenSurvey:
    """Simulate the paper's mini-mock survey and open it; an existing survey is only opened.

    Parameters
    ----------
    directory : survey directory to create; an interrupted simulation resumes
    orbits : number of orbits
    seed : seed of the random numbers
    stars : number of stars in the extended field; the paper's 132,651 by default
    catalogue : Gaia table to use as the true catalogue; synthetic by default
    defects : defects to simulate, such as "distortion-drift=0.1um"; the page Defects lists them
    magnitudes : add magnitudes to catalogue and measurements
    noise_by_magnitude : let the uncertainty of a measurement depend on the magnitude; implies
        `magnitudes`

    Raises
    ------
    InputError
        If an argument is invalid, or the directory holds other files or a survey with other
        settings.
    """
    target = path_of(directory).absolute()
    settings = SurveySettings(
        orbits=orbits,
        seed=seed,
        magnitudes=magnitudes,
        noise_by_magnitude=noise_by_magnitude,
        defects=(defects,) if isinstance(defects, str) else tuple(defects),
    )
    if stars is not None:
        settings = settings.scaled(stars)
    table = None if catalogue is None else _existing_path(catalogue)
    if (target / HEADER).is_file():
        _check_same(target, settings, table)
        return OpenSurvey(target)
    request = {
        "do": "simulate",
        "directory": str(target),
        "settings": settings.to_dict(),
        "catalogue": None if table is None else str(table),
    }
    run_job(Job(request), f"simulating {orbits_text(orbits)}")
    return OpenSurvey(target)


def _open_orbit(
    observations: _Path,
    reference: _Path,
    truth: _Path | None,
    instrument: _Path | None,
    orbit: int | None,
) -> OpenOrbit:
    # Absolute paths: a notebook may change its working directory, the solver process does not.
    files = OrbitFiles(
        str(_existing_path(observations)),
        str(_existing_path(reference)),
        None if truth is None else str(_existing_path(truth)),
        orbit,
        None if instrument is None else str(_existing_path(instrument)),
    )
    return OpenOrbit(LazySolver(files), orbit, f"plateviz.open({files.observations!r}, ...)")


def _existing_path(given: object) -> Path:
    path = path_of(given).absolute()
    if not path.exists():
        raise InputError(f"{path}: expected a file or a folder, found none")
    return path


def _refuse(given_names: set[str], what: str) -> None:
    if given_names:
        raise InputError(f"{', '.join(sorted(given_names))}: expected no such argument with {what}")


def _check_same(directory: Path, settings: SurveySettings, catalogue: Path | None) -> None:
    """Raise `InputError` if the survey was made with other settings."""
    header = read_header(directory)
    found, expected = section(header, "settings"), settings.to_dict()
    different = [name for name in {**expected, **found} if expected.get(name) != found.get(name)]
    table = None if catalogue is None else sha256_of(catalogue)
    if section(header, "catalogue").get("sha256") != table:
        different.append("catalogue")
    if different:
        raise InputError(
            f"{directory}: expected no survey or one with these settings, found one with other "
            f"{', '.join(different)}; plateviz.open opens it"
        )


def _given(path: _Path | None) -> Path | None:
    return None if path is None else _existing_path(path)
