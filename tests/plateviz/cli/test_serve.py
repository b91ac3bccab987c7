"""`plateviz serve`: the options for a reverse proxy."""

import pytest

from plateviz.dashboard.server import check_origin, check_prefix
from solver.errors import InputError
from tests.solver.growing_survey import GrowingSurvey


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--allow-origin", "https://astro.example.org"], "expected a host such as"),
        (["--allow-origin", "*"], "found '*'"),
        (["--prefix", "a b"], "--prefix: expected a path such as plateviz, found 'a b'"),
        (["--prefix", "../up?x"], "--prefix: expected a path"),
    ],
    ids=["address", "any host", "space", "query"],
)
def test_invalid_proxy_option_is_refused(run, tmp_path, options, message):
    code, _, err = run("serve", tmp_path, "--port", "0", "--no-open", *options)
    assert code == 2
    assert message in err


def test_survey_without_an_orbit_is_refused(run, made_survey, tmp_path):
    GrowingSurvey(made_survey, tmp_path / "empty", 0)
    code, _, err = run("serve", tmp_path / "empty", "--port", "0", "--no-open")
    assert code == 2
    assert "expected a survey with an orbit, found none yet" in err


@pytest.mark.parametrize("option", ["--truth", "--instrument", "--orbit"])
def test_option_of_files_is_refused_for_a_survey(run, made_survey, option):
    value = 3 if option == "--orbit" else "t.parquet"
    code, _, err = run("serve", made_survey, option, value)
    assert code == 2
    assert "expected with the files OBS and REF of an orbit only" in err


def test_host_is_normalised_as_browsers_send_it():
    assert check_origin("Astro.Example.org:8443 ") == "astro.example.org:8443"


def test_slashes_around_the_prefix_are_removed():
    assert check_prefix("/groups/plateviz/") == "groups/plateviz"
    assert check_prefix("") == ""


@pytest.mark.parametrize("text", ["", "host:", "host:80:80", ".example.org"])
def test_invalid_host_is_refused(text):
    with pytest.raises(InputError, match="--allow-origin"):
        check_origin(text)


def test_other_machines_are_served_with_a_password_only(run, tmp_path):
    options = ["serve", tmp_path, "--port", "0", "--no-open"]
    code, _, err = run(*options, "--address", "0.0.0.0")
    assert code == 2
    assert "--address 0.0.0.0: expected a password" in err
    (tmp_path / "short").write_text("secret\n")
    code, _, err = run(*options, "--password-file", tmp_path / "short")
    assert code == 2
    assert "at least 12 characters" in err
    code, _, err = run(*options, "--password-file", tmp_path / "nowhere")
    assert code == 2
    assert "--password-file: expected a text file" in err
    # What is missing now is the survey.
    for more in (["--address", "0.0.0.0", "--no-password"], ["--address", "localhost"]):
        code, _, err = run(*options, *more)
        assert code == 2
        assert "survey.toml" in err
