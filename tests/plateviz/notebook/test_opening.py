"""`plateviz.open` and `plateviz.simulate`: what they return, and one message for mistakes."""

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
def test_missing_path_is_refused(given, message):
    with pytest.raises(InputError, match=message):
        plateviz.open(*given)


def test_folder_without_a_survey_is_refused(tmp_path):
    with pytest.raises(InputError, match=r"expected a survey with a file survey\.toml"):
        plateviz.open(tmp_path)


def test_measurements_without_a_catalogue_are_refused(obs):
    with pytest.raises(InputError, match="expected a result file"):
        plateviz.open(obs)


def test_files_in_the_wrong_order_are_refused(obs, ref):
    with pytest.raises(InputError, match="sample_ref.fits"):
        plateviz.open(ref, obs)


def test_orbit_that_is_not_in_the_file_is_refused(obs, ref):
    with pytest.raises(InputError, match="orbit"):
        plateviz.open(obs, ref, orbit=77)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"orbit": 1}, "orbit: expected no such argument with a survey directory"),
        (
            {"truth": "T.fits", "instrument": "I.toml"},
            "instrument, truth: expected no such",
        ),
        ({"run": "other"}, "expected a run 'other', found none"),
    ],
    ids=["orbit", "files", "run"],
)
def test_argument_that_does_not_apply_to_a_survey_is_refused(made_survey, options, message):
    with pytest.raises(InputError, match=message):
        plateviz.open(made_survey, **options)


def test_run_with_the_files_of_an_orbit_is_refused(obs, ref):
    with pytest.raises(InputError, match="run: expected no such argument with the files"):
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
def test_invalid_request_of_a_survey_changes_nothing(made_survey, ask, message):
    before = sorted(made_survey.iterdir())
    with pytest.raises(InputError, match=message):
        ask(plateviz.open(made_survey))
    assert sorted(made_survey.iterdir()) == before


def test_existing_survey_is_opened_and_not_simulated_again(tmp_path):
    defects = ["outliers=1%", "noise=10%"]
    survey = plateviz.simulate(tmp_path / "made", orbits=1, stars=4000, seed=2, defects=defects)
    written = (survey.directory / "survey.toml").stat().st_mtime_ns
    settings = {"stars": 4000, "seed": 2, "defects": reversed(defects)}
    again = plateviz.simulate(tmp_path / "made", orbits=1, **settings)
    assert (again.directory / "survey.toml").stat().st_mtime_ns == written
    with pytest.raises(InputError, match="other orbits, seed, defects; plateviz.open"):
        plateviz.simulate(tmp_path / "made", orbits=2, stars=4000, seed=3)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"orbits": 0}, "orbits of at least 1, found 0"),
        ({"seed": 1.5}, "seed to be an integer"),
        ({"catalogue": "nowhere.fits"}, "nowhere.fits: expected a file or a folder, found none"),
        ({"defects": ["noise=10"]}, "defect noise: expected an amplitude such as noise=10%"),
        ({"defects": "noize=10%"}, "expected a defect out of .* found 'noize'"),
        ({"magnitudes": "yes"}, "expected magnitudes to be true or false"),
    ],
    ids=["orbits", "seed", "catalogue", "amplitude", "defect", "magnitudes"],
)
def test_simulation_with_an_invalid_argument_is_not_begun(tmp_path, options, message):
    with pytest.raises(InputError, match=message):
        plateviz.simulate(tmp_path / "made", stars=4000, **options)
    assert not (tmp_path / "made").exists()


def test_folder_with_other_files_is_left_unchanged(tmp_path):
    (tmp_path / "notes.txt").write_text("mine")
    with pytest.raises(InputError, match="found notes.txt"):
        plateviz.simulate(tmp_path, orbits=1, stars=4000)
    assert [path.name for path in tmp_path.iterdir()] == ["notes.txt"]


def test_dashboard_outside_a_notebook_is_text(made_survey):
    dashboard = plateviz.open(made_survey).dashboard()
    assert isinstance(dashboard.servable(), Dashboard)
    assert dashboard._repr_mimebundle_() == {"text/plain": repr(dashboard)}
    assert made_survey.name in repr(dashboard)


def test_input_error_in_a_notebook_has_no_traceback():
    assert InputError("R.fits: expected so")._render_traceback_() == [
        "InputError: R.fits: expected so"
    ]
