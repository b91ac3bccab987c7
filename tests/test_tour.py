"""The tour: kept without outputs, and runs from top to bottom in the time that it promises.

What it shows is tested in a Jupyter and served, in tests/ui/test_notebook.py.
"""

import os
import time
from pathlib import Path

import pytest

REPOSITORY = Path(__file__).resolve().parent.parent
TOUR = REPOSITORY / "assets" / "tour.ipynb"
# Twice what is promised of two cores that do nothing else.
LONGEST_S = 240


def code_cells(notebook):
    return [cell for cell in notebook.cells if cell.cell_type == "code"]


@pytest.fixture(scope="module")
def tour(nbformat):
    return nbformat.read(TOUR, as_version=4)


def test_tour_is_kept_without_outputs(nbformat, tour):
    nbformat.validate(tour)
    assert all(cell.outputs == [] for cell in code_cells(tour))
    assert all(cell.execution_count is None for cell in code_cells(tour))


def test_tour_has_words_before_every_part(tour):
    text = "\n".join(cell.source for cell in tour.cells if cell.cell_type == "markdown")
    for part in ("# A tour of plateviz", "## Fit", "## Look", "## What if", "## Follow a star"):
        assert part in text
    # `panel serve` takes the words as a Python string.
    assert "\\" not in text


def test_tour_keeps_to_what_a_person_may_use(tour):
    imports = [line for cell in code_cells(tour) for line in cell.source.split("\n")]
    assert {line for line in imports if "import" in line} == {
        "import plateviz",
        "import pandas as pd",
    }


@pytest.mark.full
@pytest.mark.slow
@pytest.mark.timeout(600)
def test_tour_runs_in_time_without_a_complaint(nbformat, tour, tmp_path):
    from nbclient import NotebookClient

    notebook = nbformat.from_dict(tour)
    client = NotebookClient(notebook, timeout=200, resources={"metadata": {"path": tmp_path}})
    begun = time.monotonic()
    # The checkout is run, not the copy that was installed before the last edit.
    client.execute(env={**os.environ, "PYTHONPATH": str(REPOSITORY)})
    kinds = {o.output_type for cell in code_cells(notebook) for o in cell.outputs}
    assert kinds == {"execute_result", "display_data"}
    assert time.monotonic() - begun < LONGEST_S
