"""The table of defects, defects as text, and what holds for each: it is alone."""

import zlib
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from solver.errors import InputError
from solver.simulate.catalogue import reference_catalogue
from solver.simulate.defects.defect import DefectStage
from solver.simulate.defects.stages import defective_catalogue
from solver.simulate.defects.table import BY_NAME, DEFECTS
from solver.simulate.defects.text import format_defect, parse_defects
from solver.simulate.settings import SurveySettings
from solver.units import unit_named
from tests.solver.simulate.defects.conftest import KEY, SETTINGS

each_defect = pytest.mark.parametrize("defect", DEFECTS, ids=lambda defect: defect.name)
BESIDE = "noise=10%"


def text_of(defect):
    return f"{defect.name}={defect.example}"


def test_names_and_random_numbers_are_of_one_defect_each():
    assert len(BY_NAME) == len(DEFECTS)
    assert len({zlib.crc32(name.encode()) for name in BY_NAME}) == len(DEFECTS)


@each_defect
def test_every_entry_is_complete(defect):
    texts = (defect.label, defect.does, defect.stands_for, defect.reference)
    assert all(texts)
    assert "Amplitude: " in defect.does or defect.name == "exposure-times"
    assert any(character.isdigit() for character in defect.reference)
    assert unit_named(defect.unit).is_equivalent(unit_named(defect.computed_in))
    assert {name for name in BY_NAME if BY_NAME[name].needs_magnitudes} == {
        "charge-transfer",
        "noise-magnitude",
    }


@each_defect
def test_text_is_read_back(defect):
    (amplitude,) = parse_defects([text_of(defect)]).values()
    assert parse_defects([format_defect(defect.name, amplitude)]) == {defect.name: amplitude}


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("noize=10%", "a defect out of distortion-drift=.*, binaries=.* found 'noize'"),
        ("", "a defect out of .* found ''"),
        ("noise", "such as noise=10%, found 'noise'"),
        ("noise=", "such as noise=10%"),
        ("noise=much", "such as noise=10%, found 'noise=much'"),
        ("noise=0.1", "such as noise=10%, found 'noise=0.1'"),
        ("noise=nan%", "such as noise=10%"),
        ("noise=3um", "a unit such as %, found 'um'"),
        ("zonal-errors=3furlongs", "a unit such as mas, found 'furlongs'"),
        ("binaries=5um", "a number without unit, found 'um'"),
        ("binaries=2.5", "a whole number from 1 to 10000, found '2.5'"),
        ("noise=-100%", "an amplitude from -99 to 10000 %, found '-100%'"),
        ("outliers=1e999%", "an amplitude from 0 to 90 %"),
        (3, "a defect as text, NAME=AMPLITUDE, found 3"),
    ],
)
def test_invalid_texts_are_refused(text, message):
    with pytest.raises(InputError, match=message):
        SurveySettings(defects=(text,))


def test_defect_given_twice_is_refused():
    with pytest.raises(InputError, match="defect noise: expected it once"):
        SurveySettings(defects=("noise=10%", "noise=20%"))


def test_units_are_converted():
    texts = ["distortion-drift=100nm", "swapped=0.002", "exposure-times=2min"]
    with pytest.raises(InputError, match="swapped"):
        parse_defects(texts)
    texts[1] = "swapped=2000ppm"
    found = parse_defects(texts)
    assert found == pytest.approx(
        {"distortion-drift": 0.1, "swapped": 0.2, "exposure-times": 120.0}
    )


def test_settings_keep_defects_in_one_order_and_form():
    given = ("noise = 0.5e2 %", "distortion-drift=100 nm")
    settings = SurveySettings(defects=given)
    assert settings.defects == ("distortion-drift=0.1um", "noise=50%")
    assert settings == SurveySettings(defects=given[::-1])
    assert SurveySettings.from_dict(settings.to_dict()) == settings


def test_settings_without_defects_are_written_as_before():
    assert not {"defects", "magnitudes", "noise_by_magnitude"} & set(SurveySettings().to_dict())
    with pytest.raises(InputError, match="expected magnitudes to be true or false, found 1"):
        SurveySettings(magnitudes=1)


@each_defect
def test_defect_leaves_the_catalogue_and_exposures_of_others(defect, measure, truth):
    settings = replace(SETTINGS, defects=(text_of(defect),))
    reference = reference_catalogue(truth, settings)
    catalogue, _ = defective_catalogue(reference, truth, settings)
    assert catalogue.equals(reference) == (defect.stage is not DefectStage.CATALOGUE)
    without, orbit = measure(), measure(text_of(defect))
    pd.testing.assert_frame_equal(orbit.attitude, without.attitude)
    assert orbit.exposures.equals(without.exposures) == (defect.stage is not DefectStage.EXPOSURES)
    if defect.stage in (DefectStage.CATALOGUE, DefectStage.EXPOSURES):
        pd.testing.assert_frame_equal(orbit.measurements, without.measurements)


@each_defect
def test_defect_is_alone_and_changes_no_other_draw(defect, measure):
    """Its effect is the same with the noise of another defect as without."""
    text = "noise-exposure=20%" if defect.name == "noise" else text_of(defect)
    alone, both, base, other = (
        measure(*names).measurements.set_index(KEY).sort_index()[["nx", "ny"]]
        for names in ((text,), (text, BESIDE), (), (BESIDE,))
    )
    assert alone.index.equals(both.index)
    if defect.name == "swapped":
        # The ids differ; the positions are those of the others.
        for first, second in ((alone, base), (both, other)):
            assert sorted(first["nx"]) == sorted(second["nx"])
        return
    if BY_NAME[text.partition("=")[0]].stage is DefectStage.NOISE:
        # Noise is a product, which the tests of the noise show.
        assert not np.allclose(alone, both)
        return
    rows = alone.index
    assert len(rows) > 0.9 * len(base)
    difference = (both - alone) - (other - base).reindex(rows)
    assert difference.abs().max(axis=None) < 1e-9


def test_orbit_without_defects_has_nothing_affected(measure):
    assert measure().affected.empty
