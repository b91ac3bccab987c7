"""Whether the measurements of the orbits of a run are still those that were fitted."""

from plateviz.runs.fitted_orbit import read_provenance
from plateviz.runs.run_directory import RunDirectory
from solver.errors import InputError
from solver.io.atomic import sha256_of
from solver.io.survey import measurement_path
from solver.io.survey_manifest import listed_files


def changed_inputs(run: RunDirectory) -> dict[int, str]:
    """Return a message for each fitted orbit whose file of measurements is another one by now.

    An orbit whose file is gone keeps its solution, which nothing could replace.

    Raises
    ------
    InputError
        If a file or the manifest of the survey cannot be read.
    """
    listed, found = listed_files(run.survey), {}
    for orbit in run.complete_orbits():
        path = measurement_path(run.survey, orbit)
        name = path.relative_to(run.survey).as_posix()
        try:
            fitted = read_provenance(run.orbit_directory(orbit)).get(name)
        except InputError:
            # The orbit is damaged, which `RunDirectory.changes` says.
            continue
        if fitted is None or not path.is_file():
            continue
        # Whether the file is the one that is listed is checked when it is read.
        if (listed.get(name) or sha256_of(path)) != fitted:
            found[orbit] = (
                f"{path}: expected the measurements that run {run.name} has fitted, found others; "
                f"`plateviz survey {run.survey} --run {run.name} --repair` fits the orbit as it is "
                "now"
            )
    return found
