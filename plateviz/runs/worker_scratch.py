"""The scratch folders of the workers of a survey, which are in the folder for temporary files."""

from solver.io.scratch import ScratchFolder, remove_abandoned, temporary_folder

_PREFIX = "plateviz-workers"


def worker_scratch() -> ScratchFolder:
    """Return a new scratch folder.

    Raises
    ------
    DiskError
        If there is no folder for temporary files that can be written.
    """
    return ScratchFolder(temporary_folder(), _PREFIX)


def remove_worker_scratch() -> None:
    """Remove what the workers of surveys that have ended left."""
    remove_abandoned(temporary_folder(), _PREFIX)
