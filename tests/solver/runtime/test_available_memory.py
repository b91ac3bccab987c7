"""Memory that may be used: that of the machine, or less in a container with a limit."""

import psutil
import pytest

from solver.runtime import available_memory
from solver.runtime.available_memory import available_bytes


@pytest.mark.parametrize(
    ("text", "expected"),
    [("4096", 4096), ("max", None), ("", None), (None, None), (str(2**62), None)],
)
def test_limit_of_a_container_counts_if_it_is_smaller(text, expected, tmp_path, monkeypatch):
    path = tmp_path / "memory.max"
    if text is not None:
        path.write_text(f"{text}\n", encoding="ascii")
    monkeypatch.setattr(available_memory, "_LIMITS", (path, tmp_path / "none"))
    assert available_bytes() == (expected or psutil.virtual_memory().total)
