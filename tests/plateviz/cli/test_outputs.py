"""What commands may write: nothing replaces an input, and nothing else unless it is asked for."""

import os
import shutil

import pytest

from solver.io.result import read_result, write_result


@pytest.fixture
def orbit(sample_orbit_dir, tmp_path):
    """Copies of the sample orbit's observation and reference."""
    for name in ("obs", "ref"):
        shutil.copy(sample_orbit_dir / f"sample_{name}.fits", tmp_path / f"{name}.fits")
    return tmp_path / "obs.fits", tmp_path / "ref.fits"


def contents(folder):
    return {path: path.read_bytes() for path in sorted(folder.rglob("*")) if path.is_file()}


def spelled(path, folder):
    (folder / "sub").mkdir()
    return folder / "sub" / ".." / path.name


def linked(path, folder):
    (folder / "link.fits").symlink_to(path)
    return folder / "link.fits"


def hard_linked(path, folder):
    os.link(path, folder / "hard.fits")
    return folder / "hard.fits"


def test_link_that_leads_to_itself_is_refused_in_words(run, orbit, tmp_path):
    loop = tmp_path / "loop.fits"
    loop.symlink_to(loop)
    for arguments in (("fit", loop, orbit[1], "-o", tmp_path / "x.fits"), ("report", loop)):
        more = () if arguments[0] == "fit" else ("-o", tmp_path / "r.html")
        code, _, err = run(*arguments, *more)
        assert code == 2
        assert "loop.fits: expected" in err


@pytest.mark.parametrize("overwrite", [[], ["--overwrite"]], ids=["", "overwrite"])
@pytest.mark.parametrize("which", [0, 1], ids=["observation", "reference"])
@pytest.mark.parametrize(
    "other_name",
    [lambda path, _: path, spelled, linked, hard_linked],
    ids=["same", "spelling", "link", "hard-link"],
)
def test_fit_does_not_replace_an_input(run, orbit, tmp_path, other_name, which, overwrite):
    output = other_name(orbit[which], tmp_path)
    before = contents(tmp_path)
    code, _, err = run("fit", *orbit, "-o", output, *overwrite)
    assert code == 2
    assert "expected another file than the inputs" in err
    assert contents(tmp_path) == before


@pytest.mark.parametrize("name", ["measurement.ecsv", "environment.ecsv"])
def test_fit_does_not_replace_the_tables_of_a_folder(run, orbit, tmp_path, name):
    folder = tmp_path / "tables"
    folder.mkdir()
    for table in ("measurement.fits", "environment.fits"):
        shutil.copy(orbit[0], folder / table)
    output = folder / name.replace(".ecsv", ".fits")
    code, _, err = run("fit", folder, orbit[1], "-o", output, "--overwrite")
    assert code == 2
    assert "expected another file than the inputs" in err


def test_checkpoint_replaces_neither_an_input_nor_the_output(run, orbit, tmp_path):
    before = contents(tmp_path)
    for checkpoint in (orbit[0], tmp_path / "r.fits"):
        options = ["--engine", "svi", "--checkpoint", checkpoint]
        code, _, err = run("fit", *orbit, "-o", tmp_path / "r.fits", *options)
        assert code == 2
        assert "expected another file than the inputs" in err
    assert contents(tmp_path) == before


def test_existing_output_is_replaced_only_on_request(run, orbit, tmp_path):
    output = tmp_path / "r.fits"
    output.write_bytes(b"mine")
    code, _, err = run("fit", *orbit, "-o", output)
    assert code == 2
    assert "r.fits: expected a new file, found one that exists" in err
    assert output.read_bytes() == b"mine"
    code, _, _ = run("fit", *orbit, "-o", output, "--overwrite")
    assert code == 0
    assert len(read_result(output).sources) == 814


@pytest.mark.parametrize("name", ["r.txt", "r", "r.fits.gz", "r.html"])
def test_result_that_could_not_be_read_is_refused_at_once(run, orbit, tmp_path, name):
    code, _, err = run("fit", *orbit, "-o", tmp_path / name)
    assert code == 2
    assert "expected a name that ends in .fits, .fit or .fts" in err
    assert not (tmp_path / name).exists()


@pytest.mark.parametrize("options", [[], ["--overwrite"]], ids=["", "overwrite"])
def test_report_does_not_replace_its_input(run, fit_result, tmp_path, options):
    write_result(fit_result, tmp_path / "r.fits")
    (tmp_path / "r.html").symlink_to(tmp_path / "r.fits")
    before = contents(tmp_path)
    code, _, err = run("report", tmp_path / "r.fits", "-o", tmp_path / "r.html", *options)
    assert code == 2
    assert "expected another file than the inputs" in err
    code, _, err = run("report", tmp_path / "r.fits", "-o", tmp_path / "r.fits", *options)
    assert code == 2
    assert "expected a name that ends in .html or .htm" in err
    assert contents(tmp_path) == before


def test_existing_report_is_kept(run, fit_result, tmp_path):
    write_result(fit_result, tmp_path / "r.fits")
    (tmp_path / "r.html").write_text("mine")
    code, _, err = run("report", tmp_path / "r.fits", "-o", tmp_path / "r.html")
    assert code == 2
    assert "expected a new file, found one that exists" in err
    assert (tmp_path / "r.html").read_text() == "mine"


def test_existing_table_of_stars_is_kept(run, tmp_path):
    (tmp_path / "stars.fits").write_text("mine")
    code, _, err = run("gaia", tmp_path / "stars.fits")
    assert code == 2
    assert "expected a new file, found one that exists" in err
    assert (tmp_path / "stars.fits").read_text() == "mine"
