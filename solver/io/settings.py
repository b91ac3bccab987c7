"""Settings of a fit as a file holds them."""

from solver.data.settings import FitSettings
from solver.errors import InputError
from solver.io.failures import reading


def parse_settings(plain: object, where: str) -> FitSettings:
    """Return the settings that `FitSettings.to_dict` wrote.

    Parameters
    ----------
    plain : content of the file
    where : the file, and the part of it that holds the settings, for messages

    Raises
    ------
    InputError
        If these are no settings, or one is unknown or invalid.
    """
    with reading(where, "the settings of a fit"):
        try:
            return FitSettings.from_dict(plain)  # type: ignore[arg-type]
        except InputError as error:
            # It names the setting, but not the file.
            raise InputError(f"{where}: {error}") from error
