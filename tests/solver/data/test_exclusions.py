import numpy as np
import pytest

from solver.data.exclusions import parse_exclusions, thinned_orbit, without_excluded
from solver.data.settings import FitSettings
from solver.data.subset import Subset
from solver.errors import InputError


@pytest.fixture
def measurements(small_orbit):
    return small_orbit.data.measurements


def test_empty_exclusions_return_the_same_orbit(small_orbit):
    assert without_excluded(small_orbit.data, Subset()) is small_orbit.data


@pytest.mark.parametrize("column", ["source_id", "detector_id"])
def test_excluded_source_or_detector_is_removed(small_orbit, measurements, column):
    value = int(measurements[column].iloc[0])
    name = {"source_id": "sources", "detector_id": "detectors"}[column]
    left = without_excluded(small_orbit.data, Subset(**{name: frozenset([value])})).measurements
    expected = measurements[measurements[column] != value]
    np.testing.assert_array_equal(left.index, expected.index)


def test_excluded_exposure_is_removed_from_both_tables(small_orbit, measurements):
    plate = tuple(measurements[["field_id", "plate_id"]].iloc[0].tolist())
    left = without_excluded(small_orbit.data, Subset(exposures=frozenset([plate])))
    for table in (left.measurements, left.exposures):
        assert plate not in set(zip(table["field_id"], table["plate_id"], strict=True))
    assert len(left.exposures) == len(small_orbit.data.exposures) - 1


@pytest.mark.parametrize(
    ("exclusions", "named"),
    [
        (Subset(sources=frozenset([-5])), "source -5"),
        (Subset(detectors=frozenset([77])), "detector 77"),
        (Subset(exposures=frozenset([(9, 99)])), "exposure 9/99"),
    ],
    ids=["source", "detector", "exposure"],
)
def test_excluding_unmeasured_items_raises(small_orbit, exclusions, named):
    with pytest.raises(InputError, match=f"excluded {named}: expected one with measurements"):
        without_excluded(small_orbit.data, exclusions)


def test_excluding_everything_raises(small_orbit, measurements):
    everything = Subset(detectors=frozenset(measurements["detector_id"].tolist()))
    with pytest.raises(InputError, match="expected some measurements"):
        without_excluded(small_orbit.data, everything)


def test_exclusions_are_parsed():
    found = parse_exclusions(["source=12", " detector=3", "exposure=1/20", "source=-4"])
    assert found == Subset(frozenset([12, -4]), frozenset([(1, 20)]), frozenset([3]))


@pytest.mark.parametrize(
    "text", ["", "source", "source=x", "exposure=3", "plate=1/2", "source=1.5"]
)
def test_invalid_exclusion_raises(text):
    with pytest.raises(InputError, match="source=ID, exposure=FIELD/PLATE or detector=ID"):
        parse_exclusions([text])


def test_exclusions_round_trip_in_settings():
    settings = FitSettings(exclusions=parse_exclusions(["source=12", "exposure=1/20"]))
    assert FitSettings.from_dict(settings.to_dict()) == settings


def test_settings_without_exclusions_are_read():
    values = FitSettings().to_dict()
    del values["exclusions"]
    assert FitSettings.from_dict(values) == FitSettings()


def test_thinned_orbit_keeps_a_share_of_each_class(small_orbit):
    data = small_orbit.data
    is_reference = data.catalogue.set_index("source_id")["is_reference"]

    def counts(orbit):
        return np.bincount(is_reference.loc[orbit.measurements["source_id"].unique()], minlength=2)

    thinned = thinned_orbit(data, data, 3)
    np.testing.assert_array_equal(counts(thinned), -(-counts(data) // 3))
    assert thinned_orbit(data, data, 1) is data


def test_thinned_sources_do_not_depend_on_exclusions(small_orbit):
    data = small_orbit.data
    kept = thinned_orbit(data, data, 3).measurements["source_id"].unique()
    left = without_excluded(data, Subset(sources=frozenset([int(kept[0])])))
    assert set(thinned_orbit(left, data, 3).measurements["source_id"]) == set(kept[1:])
