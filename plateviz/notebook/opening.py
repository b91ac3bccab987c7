"""What a person gives, and the object that it opens."""

from os import PathLike
from pathlib import Path

from plateviz.notebook.lazy_solver import LazySolver, run_job
from plateviz.notebook.orbit import OpenOrbit
from plateviz.notebook.report import path_of
from plateviz.notebook.solution import OpenSolution
from plateviz.notebook.survey import OpenSurvey
from plateviz.solving.job import Job
from plateviz.solving.origin import OrbitFiles
from solver.data.instrument import MINI_MOCK, read_instrument
from solver.errors import InputError
from solver.io.atomic import sha256_of
from solver.io.result import read_result
from solver.io.survey import HEADER, read_header, section
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
    path : a survey directory; or a result of `plateviz fit`; or, with a reference catalogue,
        the measurements and exposures of an orbit, as `plateviz fit` takes them
    reference : the reference catalogue, with measurements
    truth : the true catalogue of a simulation, with measurements
    instrument : a TOML file, with measurements or a solution; the mini-mock's by default
    orbit : the orbit to take where the files hold several
    run : name of a survey's run; the first whole one by default

    Returns
    -------
    A survey, an orbit, or a solution.

    Raises
    ------
    InputError
        If something is not there, or wrong with it.
    """
    given = {"truth": truth, "instrument": instrument, "orbit": orbit, "run": run}
    chosen = {name for name, value in given.items() if value is not None}
    if reference is not None:
        _refuse(chosen & {"run"}, "the files of an orbit")
        return _open_orbit(path, reference, truth, instrument, orbit)
    place = _there(path)
    if place.is_dir():
        _refuse(chosen - {"run"}, "a survey directory")
        return OpenSurvey(place, run)
    _refuse(chosen - {"instrument"}, "a solution, or a reference catalogue beside measurements")
    camera = MINI_MOCK if instrument is None else read_instrument(_there(instrument))
    return OpenSolution(read_result(place), camera, place.name, f"plateviz.open({str(place)!r})")


def simulate(
    directory: _Path,
    *,
    orbits: int = 100,
    seed: int = 0,
    stars: int | None = None,
    catalogue: _Path | None = None,
) -> OpenSurvey:
    """Simulate the paper's mini-mock survey, and open it; one that is there is opened.

    Parameters
    ----------
    directory : to make; one that was interrupted is gone on with
    orbits : number of orbits
    seed : of all random numbers
    stars : in the extended field, instead of the paper's 132,651
    catalogue : a Gaia table to take as the truth, instead of a synthetic one

    Raises
    ------
    InputError
        If a choice cannot be used, or the directory holds something else, such as a survey of
        other choices.
    """
    place = path_of(directory).absolute()
    settings = SurveySettings(orbits=orbits, seed=seed)
    if stars is not None:
        settings = settings.scaled(stars)
    table = None if catalogue is None else _there(catalogue)
    if (place / HEADER).is_file():
        _check_same(place, settings, table)
        return OpenSurvey(place)
    request = {
        "do": "simulate",
        "directory": str(place),
        "settings": settings.to_dict(),
        "catalogue": None if table is None else str(table),
    }
    run_job(Job(request), f"simulating {orbits} orbits")
    return OpenSurvey(place)


def _open_orbit(
    observations: _Path,
    reference: _Path,
    truth: _Path | None,
    instrument: _Path | None,
    orbit: int | None,
) -> OpenOrbit:
    # Of all paths the absolute ones: a notebook may change its folder, the solver's does not.
    files = OrbitFiles(
        str(_there(observations)),
        str(_there(reference)),
        None if truth is None else str(_there(truth)),
        orbit,
        None if instrument is None else str(_there(instrument)),
    )
    return OpenOrbit(LazySolver(files), orbit, f"plateviz.open({files.observations!r}, ...)")


def _there(given: object) -> Path:
    path = path_of(given).absolute()
    if not path.exists():
        raise InputError(f"{path}: expected a file or a folder, found none")
    return path


def _refuse(chosen: set[str], what: str) -> None:
    if chosen:
        raise InputError(f"{', '.join(sorted(chosen))}: expected nothing of the kind with {what}")


def _check_same(directory: Path, settings: SurveySettings, catalogue: Path | None) -> None:
    """Refuse a survey that was made with other choices."""
    header = read_header(directory)
    found, wanted = section(header, "settings"), settings.to_dict()
    different = [name for name in {**wanted, **found} if wanted.get(name) != found.get(name)]
    table = None if catalogue is None else sha256_of(catalogue)
    if section(header, "catalogue").get("sha256") != table:
        different.append("catalogue")
    if different:
        raise InputError(
            f"{directory}: expected a survey of these choices or none, found one of other "
            f"{', '.join(different)}; plateviz.open opens it"
        )
