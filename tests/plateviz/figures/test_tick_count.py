"""Number of ticks for which the axes of a frame have room."""

import pytest

from plateviz.figures.figure import Axis
from plateviz.figures.tick_count import columns_of_ticks, rows_of_ticks


@pytest.mark.parametrize(
    ("limits", "width", "expected"),
    [
        ((4.3, -4.3), 95, 5),  # labels such as "-4"
        ((-1200.0, 1200.0), 82, 2),  # labels such as "-1000"
        ((2028.1, 2030.9), 168, 4),  # labels such as "2028.5"
        ((0.0, 1.0), 900, 6),
        ((0.0, 1.0), 1, 2),
        ((1.0, 1.0), 100, 6),
    ],
)
def test_as_many_labels_as_have_room_beside_each_other(limits, width, expected):
    assert columns_of_ticks(Axis("x", limits), width) == expected


def test_higher_frames_have_more_rows_of_labels():
    assert [rows_of_ticks(height) for height in (1, 60, 95, 150, 600)] == [2, 3, 5, 6, 6]
