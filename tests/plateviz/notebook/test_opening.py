"""What a person gives to open or to simulate: what comes of it, and one message for mistakes."""

import pytest

import plateviz
from plateviz.notebook.dashboard import Dashboard
from solver.errors import InputError


@pytest.fixture
def obs(sample_orbit_dir):
    return sample_orbit_dir / "sample_obs.fits"


@pytest.fixture
def ref(sample_orbit_dir):
    return sample_orbit_dir / "sample_ref.fits"


@pytest.mark.parametrize(
    ("given", "message"),
    [
        (("nowhere",), "nowhere: expected a file or a folder, found none"),
        ((3,), "path of a file or a folder, found 3"),
        (("obs.fits", "nowhere.fits"), "obs.fits: expected a file or a folder, found none"),
    ],
    ids=["absent", "no path", "absent file"],
)
def test_what_is_not_there_is_refused(given, message):
    with pytest.raises(InputError, match=message):
        plateviz.open(*given)


def test_folder_that_is_no_survey_is_refused(tmp_path):
    with pytest.raises(InputError, match=r"expected a survey with a file survey\.toml"):
        plateviz.open(tmp_path)


def test_measurements_without_a_catalogue_are_no_result(obs):
    with pytest.raises(InputError, match="expected a result file"):
        plateviz.open(obs)


def test_files_in_the_wrong_order_are_refused(obs, ref):
    with pytest.raises(InputError, match="sample_ref.fits"):
        plateviz.open(ref, obs)


def test_orbit_that_the_file_has_not_is_refused(obs, ref):
    with pytest.raises(InputError, match="orbit"):
        plateviz.open(obs, ref, orbit=77)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"orbit": 1}, "orbit: expected nothing of the kind with a survey directory"),
        ({"truth": "T.fits", "instrument": "I.toml"}, "instrument, truth: expected nothing"),
        ({"run": "other"}, "expected a run 'other', found none"),
    ],
    ids=["orbit", "files", "run"],
)
def test_options_of_something_else_are_refused(made_survey, options, message):
    with pytest.raises(InputError, match=message):
        plateviz.open(made_survey, **options)


def test_run_is_of_a_survey(obs, ref):
    with pytest.raises(InputError, match="run: expected nothing of the kind with the files"):
        plateviz.open(obs, ref, run="default")


@pytest.mark.parametrize(
    ("ask", "message"),
    [
        (lambda s: s.orbit(9), "an orbit out of 0 to 2, found 9"),
        (lambda s: s.orbit("1"), "an orbit out of 0 to 2, found '1'"),
        (lambda s: s.source(1), r"expected a run, found none; \.fit\(\) makes one"),
        (lambda s: s.motions, "expected a run, found none"),
        (lambda s: s.figures, "expected a run, found none"),
        (lambda s: s.report("r.html"), "expected a run, found none"),
        (lambda s: s.table("stars"), "table out of orbits, motions, catalogue, truth"),
        (lambda s: s.fit(order=10), "order from 0 to 9"),
        (lambda s: s.fit(orbits="0-3"), "orbits: expected whole numbers from 0, found '0-3'"),
        (lambda s: s.fit(workers=0), "workers: expected whole numbers from 1"),
        (lambda s: s.dashboard(port=-1), "port: expected 0 to 65535, found -1"),
        (lambda s: s.dashboard(height="tall"), "height: expected a number of pixels"),
    ],
    ids=lambda value: value[:30] if isinstance(value, str) else "",
)
def test_mistake_with_a_survey_is_one_message_and_changes_nothing(made_survey, ask, message):
    before = sorted(made_survey.iterdir())
    with pytest.raises(InputError, match=message):
        ask(plateviz.open(made_survey))
    assert sorted(made_survey.iterdir()) == before


def test_simulated_survey_is_found_again(tmp_path):
    survey = plateviz.simulate(tmp_path / "made", orbits=1, stars=4000, seed=2)
    written = (survey.directory / "survey.toml").stat().st_mtime_ns
    again = plateviz.simulate(tmp_path / "made", orbits=1, stars=4000, seed=2)
    assert (again.directory / "survey.toml").stat().st_mtime_ns == written
    with pytest.raises(InputError, match="found one of other orbits, seed; plateviz.open opens it"):
        plateviz.simulate(tmp_path / "made", orbits=2, stars=4000, seed=3)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"orbits": 0}, "orbits of at least 1, found 0"),
        ({"seed": 1.5}, "seed to be an integer"),
        ({"catalogue": "nowhere.fits"}, "nowhere.fits: expected a file or a folder, found none"),
    ],
    ids=["orbits", "seed", "catalogue"],
)
def test_survey_of_wrong_choices_is_not_begun(tmp_path, options, message):
    with pytest.raises(InputError, match=message):
        plateviz.simulate(tmp_path / "made", stars=4000, **options)
    assert not (tmp_path / "made").exists()


def test_folder_of_something_else_is_left_as_it_is(tmp_path):
    (tmp_path / "notes.txt").write_text("mine")
    with pytest.raises(InputError, match="found notes.txt"):
        plateviz.simulate(tmp_path, orbits=1, stars=4000)
    assert [path.name for path in tmp_path.iterdir()] == ["notes.txt"]


def test_dashboard_outside_a_notebook_is_words(made_survey):
    dashboard = plateviz.open(made_survey).dashboard()
    assert isinstance(dashboard.servable(), Dashboard)
    assert dashboard._repr_mimebundle_() == {"text/plain": repr(dashboard)}
    assert made_survey.name in repr(dashboard)


def test_notebook_shows_a_mistake_without_a_traceback():
    assert InputError("R.fits: expected so")._render_traceback_() == [
        "InputError: R.fits: expected so"
    ]
