"""The table of what differs between two solutions, or two runs, as a file."""

import re

import pandas as pd
from astropy.table import Table

_NUMBER = re.compile(r"[+−]?(\d{1,3}(,\d{3})+|\d+)(\.\d+)?")


def changes_file(changes: pd.DataFrame) -> dict[str, Table]:
    """Return a table of texts with its numbers as programs read them: "-69418.7", not "−69,418.7".

    Parameters
    ----------
    changes : `verdict.solution_changes` or `verdict.run_changes`, in the unit on the screen
    """
    return {"changes": Table.from_pandas(changes.map(_as_programs_read))}


def _as_programs_read(text: str) -> str:
    is_number = _NUMBER.fullmatch(text) is not None
    return text.replace(",", "").replace("−", "-") if is_number else text
