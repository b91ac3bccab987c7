"""Kinds of file of the campaign of mutated files: seeds, mutations and the product's readers."""

import hashlib
import re
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
from tornado.escape import parse_qs_bytes

from plateviz.dashboard.navigation.navigation import Navigation, View
from plateviz.dashboard.session.session import Session
from plateviz.runs.kept_solutions import KeptSolutions
from plateviz.runs.load_tables import survey_tables
from plateviz.runs.run import Run, open_run, survey_runs
from plateviz.runs.run_directory import RunDirectory
from plateviz.solving.origin import SurveyFolder
from solver.data.columns import Table, numpy_dtype
from solver.data.instrument import read_instrument
from solver.data.orbit import OrbitData
from solver.data.result import FitResult
from solver.data.schema import CATALOGUE, ENVIRONMENT, MEASUREMENT, RESULT_TABLES, TRUTH
from solver.io.inspect import inspect_files
from solver.io.read_orbit import read_orbit
from solver.io.result import read_result, read_versions
from solver.io.survey import REFERENCE, TRUTH_FILE, read_survey_orbit, read_survey_table
from tests.campaigns import mutators, seed_files
from tests.campaigns.mutators import Mutator
from tests.campaigns.seed_files import ORBITS, RUN
from tests.plateviz.dashboard.fake_store import FakeStore
from tests.solver.io_samples import FIRST_ID

# Names of exceptions, and other internals of Python.
_INTERNALS = re.compile(
    r"\b[A-Z]\w*(?:Error|Exception|Warning|Invalid)\b|<class |Traceback|object at 0x"
)

# Name of a value -> the value.
Values = Mapping[str, object]


class RefusedError(Exception):
    """An invalid value of an address was ignored, and the default taken."""


class WrongError(Exception):
    """What a reader returned or said is not as it should be."""


class Kind(NamedTuple):
    """One kind of file.

    Attributes
    ----------
    name : in the table of the campaign
    make : writes the seed files to a folder
    mutators : of its bytes
    readers : name -> reader of the folder; each is tried, whatever the others do
    is_protected : whether other values must be refused, given the name of the mutated file, and
        its bytes
    targets : pattern of the files that are mutated
    can_vanish : whether a file may be removed instead of mutated, by its name
    is_folder : whether its files are one thing, so that a refusal need not name the mutated one
    """

    name: str
    make: Callable[[Path, OrbitData], None]
    mutators: tuple[Mutator, ...]
    readers: Mapping[str, Callable[[Path], Values]]
    is_protected: Callable[[str, bytes], bool] = lambda *_: False
    targets: str = "**/*"
    can_vanish: Callable[[str], bool] = lambda _: False
    is_folder: bool = False


def fingerprint(values: Values) -> dict[str, str]:
    """Return name -> hash of each value; a table's columns are values of their own."""
    found = {}
    for name, value in values.items():
        if isinstance(value, pd.DataFrame):
            found[f"{name} rows"] = str(len(value))
            for column in value:
                found[f"{name}.{column}"] = _digest(value[column])
        else:
            found[name] = repr(value)
    return found


def _digest(column: pd.Series) -> str:
    array = column.to_numpy()
    content = repr(array.tolist()).encode() if array.dtype == object else array.tobytes()
    return f"{column.dtype} {hashlib.sha256(content).hexdigest()[:16]}"


def _orbit_values(orbit: OrbitData) -> Values:
    tables = {
        "measurements": (orbit.measurements, MEASUREMENT),
        "exposures": (orbit.exposures, ENVIRONMENT),
        "catalogue": (orbit.catalogue, CATALOGUE),
        "truth": (orbit.truth, TRUTH),
    }
    for name, (frame, schema) in tables.items():
        if frame is not None:
            _check(name, frame, schema)
    return {name: frame for name, (frame, _) in tables.items()}


def _check(name: str, frame: pd.DataFrame, schema: Table) -> None:
    """Raise WrongError if a reader's table does not satisfy its schema."""
    _require(list(frame.columns) == schema.names, f"{name}: columns {list(frame.columns)}")
    _require(len(frame) > 0, f"{name}: no rows")
    key = list(schema.key)
    _require(not key or not frame.duplicated(key).any(), f"{name}: rows repeated")
    for column in schema:
        values = frame[column.name].to_numpy()
        _require(values.dtype == numpy_dtype(column), f"{name}.{column.name}: {values.dtype}")
        if column.dtype == "float64":
            low, high = column.limits
            valid = (values >= low) & (values <= high)
            may_be_nan = column.may_be_nan or (not column.required and column.default is None)
            valid |= np.isnan(values) & may_be_nan
            _require(bool(valid.all()), f"{name}.{column.name}: {values[~valid][:3]}")


def _result_values(result: FitResult) -> Values:
    tables = {table.name: getattr(result, table.name) for table in RESULT_TABLES}
    for table in RESULT_TABLES:
        if tables[table.name] is not None:
            columns = list(tables[table.name])
            _require(columns == table.names, f"{table.name}: columns {columns}")
    settings = sorted(result.settings.to_dict().items())
    return {
        **tables,
        "settings": settings,
        "summary": sorted(result.summary.items()),
        "provenance": sorted(result.provenance.items()),
    }


def _read_fits_orbit(folder: Path) -> Values:
    paths = (folder / f"{name}.fits" for name in ("OBS", "REF", "TRUTH"))
    return _orbit_values(read_orbit(*paths))


def _read_tables(suffix: str) -> Callable[[Path], Values]:
    def read(folder: Path) -> Values:
        listed = (folder / f"{name}{suffix}" for name in ("catalogue", "truth"))
        return _orbit_values(read_orbit(folder, *listed))

    return read


def inspect(path: Path) -> Values:
    """Inspect a file or a folder: problems are listed, and nothing may be raised."""
    for problem in inspect_files([path])[0]["problems"]:
        check_words(problem, str(path))
    return {}


def check_words(message: str, *names: str) -> None:
    """Raise WrongError unless a refusal is in words and names one of `names`."""
    _require(bool(message.strip()), "a refusal without words")
    _require(any(name in message for name in names), f"a refusal that names no file: {message}")
    found = _INTERNALS.search(message)
    _require(not found, f"a refusal that shows {found and found[0]}: {message}")


def _require(holds: bool, fault: str) -> None:
    if not holds:
        raise WrongError(fault)


def _read_survey(folder: Path) -> Values:
    values: dict[str, object] = {"orbits": (orbits := SurveyFolder(str(folder)).orbits())}
    for orbit in orbits:
        read = _orbit_values(read_survey_orbit(folder, orbit))
        values |= {f"{name} {orbit}": table for name, table in read.items()}
    return values


def _tables_of_survey(folder: Path) -> Values:
    return {
        name: read_survey_table(folder / name, schema)
        for name, schema in ((REFERENCE, CATALOGUE), (TRUTH_FILE, TRUTH))
    }


def _survey_instrument(folder: Path) -> Values:
    return {"instrument": SurveyFolder(str(folder)).read_instrument()}


class MutatedStore(FakeStore):
    """A store over a survey whose files are mutated, without a solver."""

    title = "mutated"

    def __init__(self, folder: Path) -> None:
        super().__init__(result=None)
        self.origin = SurveyFolder(str(folder))
        self.orbits = self.origin.orbits()
        self.instrument = self.origin.read_instrument()
        self.kept = KeptSolutions(self.origin.solutions)

    def runs(self) -> list[Run]:
        return survey_runs(Path(self.origin.directory))


def _run(folder: Path) -> Run:
    return open_run(folder, RUN)


def _read_survey_tables(folder: Path) -> Values:
    tables = survey_tables(_run(folder))
    return {name: getattr(tables, name) for name in type(tables).__dataclass_fields__}


def _one_by_one(folder: Path) -> Values:
    run, values = _run(folder), {}
    for source in (FIRST_ID, FIRST_ID + 3):
        values[f"history {source}"] = run.history(source)
        motion = run.motion(source)
        values[f"motion {source}"] = None if motion is None else sorted(motion.items())
    return values


def _orbits_of_run(folder: Path) -> Values:
    run = _run(folder)
    results = {n: _result_values(run.result(n)) for n in ORBITS if run.has_fitted(n)}
    return {f"{name} {n}": v for n, one in results.items() for name, v in one.items()}


def _changes(folder: Path) -> Values:
    for message in RunDirectory(folder, RUN).changes():
        check_words(message, str(folder))
    return {}


def _page(folder: Path) -> Values:
    """Open the page of a source; why it is not shown is a message of the page."""
    page = Navigation(Session(MutatedStore(folder)))  # type: ignore[arg-type]
    page.begin({"source": str(FIRST_ID)})
    if page.found is None:
        check_words(page.message, str(folder))
        raise RefusedError(page.message)
    return {"history": page.found.history, "view": page.view.value}


_RUN_READERS: dict[str, Callable[[Path], Values]] = {
    "header": lambda folder: {"header": _run(folder).header()},
    "settings": lambda folder: {"settings": RunDirectory(folder, RUN).settings()},
    "orbits": lambda folder: {"orbits": _run(folder).orbits()},
    "results": _orbits_of_run,
    "motions": lambda folder: {"motions": _run(folder).motions()},
    "counts": lambda folder: {"counts": _run(folder).counts()},
    "errors": lambda folder: {"errors": _run(folder).errors_by_count()},
    "classes": lambda folder: {"classes": _run(folder).classes(1).reset_index()},
    "sources": _one_by_one,
    "failures": lambda folder: {"failures": _run(folder).failures()},
    "gathered": lambda folder: {"gathered": RunDirectory(folder, RUN).gathered_orbits()},
    "survey tables": _read_survey_tables,
    "page": _page,
    "changes": _changes,
}


def _open_address(folder: Path) -> Values:
    """Open a page by its address, and again by the address that it then shows."""
    store = MutatedStore(folder)
    # As the server decodes it.
    query = parse_qs_bytes((folder / "address").read_bytes(), keep_blank_values=True)
    requested = {name: values[0].decode("utf-8", "replace") for name, values in query.items()}
    shown, default = _shown(store, requested), _shown(store, {})
    again = _shown(store, shown)
    _require(again == shown, f"{again} of the address {shown}")
    ignored = []
    for name in _ADDRESS:
        wanted, found = requested.get(name, "").strip(), shown.get(name)
        if found != wanted and not (name == "source" and wanted and _is_same_id(wanted, found)):
            valid = (default.get(name), "all", *_VALID.get(name, ()))
            _require(found in valid or name == "plates", f"{name}: {found!r} for {wanted!r}")
            ignored.append(name)
    if ignored:
        raise RefusedError(f"ignored: {', '.join(ignored)}")
    return shown


_ADDRESS = ("view", "orbit", "field", "plates", "detector", "run", "source")
_VALID = {"view": tuple(view.value for view in View), "source": (None,)}


def _is_same_id(text: str, found: str | None) -> bool:
    is_id = re.fullmatch("-?[0-9]{1,19}", text) is not None
    return is_id and found is not None and int(text) == int(found)


def _shown(store: MutatedStore, address: Mapping[str, str]) -> dict[str, str]:
    """Return the address of a page that was opened by one, with its orbit on the screen."""
    navigation = Navigation(Session(store))  # type: ignore[arg-type]
    navigation.begin(address)
    view = navigation.view.value
    navigation.turn_to(View.ORBIT)
    return {**navigation.address(), "view": view}


def _always(name: str, content: bytes) -> bool:
    del name, content
    return True


def _has_checksums(name: str, content: bytes) -> bool:
    del name
    return mutators.has_checksums(content)


def _is_kept(name: str, content: bytes) -> bool:
    """Whether a file of a run that is not complete has checksums."""
    del content
    return name.endswith(".parquet") or f"{RUN}/orbit=" in name


def _is_no_manifest(name: str) -> bool:
    return not name.endswith(("COMPLETE", ".sha256"))


_FITS = {"orbit": _read_fits_orbit}
_RESULT = {
    "result": lambda folder: _result_values(read_result(folder / "RESULT.fits")),
    "versions": lambda folder: {"versions": read_versions(folder / "RESULT.fits")},
}
_INSTRUMENT = {
    "instrument": lambda folder: {"instrument": read_instrument(folder / "instrument.toml")},
}
_SURVEY = {
    "orbits": _read_survey,
    "tables": _tables_of_survey,
    "instrument": _survey_instrument,
}
_RUN_FILES = f"runs/{RUN}/**/*"


def _of_tables(
    name: str, make: Callable[[Path, OrbitData], None], suffix: str, **more: Any
) -> Kind:
    return Kind(name, make, mutators.TEXT, {"orbit": _read_tables(suffix)}, **more)


KINDS = (
    Kind("FITS with checksums", seed_files.make_fits, mutators.FITS, _FITS, _has_checksums),
    Kind("FITS without checksums", seed_files.make_plain_fits, mutators.FITS, _FITS),
    Kind("FITS of a result", seed_files.make_result, mutators.FITS, _RESULT, _has_checksums),
    _of_tables("ECSV", seed_files.make_ecsv, ".ecsv"),
    _of_tables("CSV", seed_files.make_csv, ".csv"),
    _of_tables("VOTable", seed_files.make_votable, ".xml"),
    _of_tables("Parquet", seed_files.make_parquet, ".parquet", is_protected=_always),
    Kind("TOML of an instrument", seed_files.make_instrument, mutators.TEXT, _INSTRUMENT),
    Kind(
        "survey",
        seed_files.make_survey,
        mutators.TEXT,
        _SURVEY,
        is_protected=_always,
        can_vanish=_is_no_manifest,
        is_folder=True,
    ),
    Kind(
        "survey without manifest",
        seed_files.make_unlisted_survey,
        mutators.TEXT,
        _SURVEY,
        is_folder=True,
    ),
    Kind(
        "run",
        seed_files.make_run,
        mutators.TEXT,
        _RUN_READERS,
        is_protected=_always,
        targets=_RUN_FILES,
        can_vanish=_is_no_manifest,
        is_folder=True,
    ),
    *(
        Kind(
            name,
            make,
            mutators.TEXT,
            _RUN_READERS,
            is_protected=_is_kept,
            targets=_RUN_FILES,
            is_folder=True,
        )
        for name, make in (
            ("run with a failed orbit", seed_files.make_failed_run),
            ("run that was interrupted", seed_files.make_interrupted_run),
        )
    ),
    Kind(
        "address",
        seed_files.make_address,
        mutators.TEXT,
        {"page": _open_address},
        targets="address",
        is_folder=True,
    ),
)
