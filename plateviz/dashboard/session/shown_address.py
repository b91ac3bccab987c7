"""What is shown of an orbit, as parts of an address: its field, exposures and detector."""

import re
from collections.abc import Mapping
from typing import Any

from plateviz.dashboard.address_parts import quoted
from solver.data.ids import ID, is_id

SHOWN = ("field", "plates", "detector")
_PLATES = re.compile(rf"({ID})-({ID})")


def shown_parts(shown: Mapping[str, Any]) -> dict[str, str]:
    """Return what is shown as parts of an address, which `read_shown` reads back."""
    return {
        name: "{}-{}".format(*value) if name == "plates" else str(value)
        for name, value in shown.items()
    }


def read_shown(address: Mapping[str, str]) -> tuple[dict[str, Any], list[str]]:
    """Return what an address asks for, and the invalid values in words.

    Whether an orbit has such fields, exposures and detectors is not known here.
    """
    shown: dict[str, Any] = {k: address[k] for k in ("field", "detector") if k in address}
    if "plates" not in address:
        return shown, []
    found = _PLATES.fullmatch(address["plates"])
    plates = sorted(map(int, found.groups())) if found else []
    if not plates or not all(map(is_id, plates)):
        return shown, [f"plates: expected FIRST-LAST, found {quoted(address['plates'])}"]
    return shown | {"plates": tuple(plates)}, []
