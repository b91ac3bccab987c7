"""Subset: sources, exposures and detectors as sets, in tables and as text."""

import pandas as pd

from solver.data.subset import KINDS, NOTHING, Subset

SOME = Subset(frozenset([1]), frozenset([(1, 0)]), frozenset([3]))
MORE = Subset(frozenset([1, 12]), frozenset([(1, 0), (1, 20)]), frozenset([3]))


def test_subsets_combine_kind_by_kind():
    rest = Subset(frozenset([12]), frozenset([(1, 20)]))
    assert rest == MORE - SOME
    assert rest | SOME == MORE
    assert MORE & rest == rest
    assert SOME <= MORE
    assert not MORE <= SOME
    assert NOTHING <= SOME


def test_kinds_are_those_with_members():
    assert MORE.kinds == [*KINDS]
    assert (MORE - SOME).kinds == ["sources", "exposures"]
    assert MORE.of_kinds(["detectors"]) == Subset(detectors=frozenset([3]))
    assert not NOTHING
    assert SOME


def test_digest_is_that_of_the_ids():
    digests, others = SOME.digests, MORE.digests
    assert digests["detectors"] == others["detectors"]
    assert digests["sources"] != others["sources"]
    assert digests == Subset(SOME.sources, SOME.exposures, SOME.detectors).digests


def test_members_have_names():
    names = ["source 1", "source 12", "exposure 1/0", "exposure 1/20", "detector 3"]
    assert MORE.names() == names
    many = Subset(frozenset(range(132)), detectors=frozenset([2]))
    assert many.short_names() == ["132 sources", "detector 2"]


def test_plain_values_are_read_back():
    assert Subset.from_dict(MORE.to_dict()) == MORE


def test_rows_of_any_source_exposure_or_detector_are_held():
    rows = pd.DataFrame(
        {
            "source_id": [1, 2, 3, 4],
            "field_id": [0, 0, 1, 1],
            "plate_id": [0, 1, 0, 1],
            "detector_id": [0, 1, 2, 3],
        }
    )
    assert SOME.holds(rows).tolist() == [True, False, True, True]
    assert not NOTHING.holds(rows).any()
    exposures = rows[["field_id", "plate_id"]]
    assert SOME.holds(exposures).tolist() == [False, False, True, False]
