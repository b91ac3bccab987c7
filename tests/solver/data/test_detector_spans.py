import numpy as np

from solver.data.detector_spans import motion_elements


def test_a_detector_has_an_element_per_span_after_the_first():
    spans, detector = np.array([0, 1, 1, 2]), np.array([[0], [1]])
    found = motion_elements(spans, np.arange(4), detector)
    # The first span, in which nothing moves, shares the element of the second.
    assert found.tolist() == [[0, 0, 0, 1], [2, 2, 2, 3]]


def test_without_a_second_span_each_detector_has_one_element():
    assert motion_elements(np.zeros(2, dtype=int), np.arange(2), np.array([0, 1])).tolist() == [
        0,
        1,
    ]
