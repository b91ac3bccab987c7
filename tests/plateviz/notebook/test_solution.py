"""A solution: its tables with and without units, its figures, its report, and mistakes."""

import subprocess
import sys
from dataclasses import replace

import astropy.units as u
import numpy as np
import pytest

import plateviz
from plateviz.notebook.solution import OpenSolution
from plateviz.notebook.table import FITTED
from plateviz.plots.gallery import diagnostics
from solver.data.schema import RESULT_TABLES
from solver.errors import InputError
from solver.io.result import read_result

OF_COMPARISON = {"comparison", "distortion-comparison", "distortion-truth", "orders"}


@pytest.fixture(scope="module")
def solution(fit_result, instrument):
    return OpenSolution(fit_result, instrument, "test", "plateviz.open('test')")


def test_text_and_card_have_the_title_and_the_verdict(solution):
    assert repr(solution).startswith(f"Orbit {solution.result.orbit_id}, order 5 (test): ")
    assert repr(solution).endswith(solution.verdict.headline)
    card = solution._repr_html_()
    assert solution.verdict.headline in card
    assert "χ² per degree of freedom" in card


def test_card_does_not_restyle_the_cells_of_a_notebook(solution):
    assert "\n.cell" not in solution._repr_html_()
    assert ".strip .cell" in solution._repr_html_()


def test_tables_are_those_of_the_result_and_the_fitted_calibration(solution, fit_result):
    available = [t.name for t in RESULT_TABLES if getattr(fit_result, t.name) is not None]
    assert list(solution.tables) == [*FITTED, *available]
    assert len(solution.detectors) == 4
    assert len(solution.pointings) == len(solution.exposures) == len(fit_result.exposures)
    assert list(solution.tables.residuals) == list(solution.residuals)


def test_changing_a_table_changes_a_copy(solution, fit_result):
    before = fit_result.sources["ra"].copy()
    table = solution.sources
    table["ra"] = 0.0
    assert fit_result.sources["ra"].equals(before)
    assert solution.sources["ra"].equals(before)


def test_fitted_calibration_is_that_of_the_result(solution, fit_result):
    fitted = fit_result.values_on("det", "sigma_marginal")["detector_x"]
    assert np.array_equal(solution.detectors["detector_x_sigma"], fitted)
    terms = solution.distortion["element"]
    assert terms.is_unique


@pytest.mark.parametrize(
    ("table", "column", "unit"),
    [
        ("sources", "ra", u.deg),
        ("residuals", "residual_x", u.pix),
        ("detectors", "detector_x", u.um),
        ("pointings", "pointing_ra_sigma", u.arcsec),
    ],
)
def test_astropy_table_has_units(solution, table, column, unit):
    found = solution.table(table)
    assert found[column].unit == unit
    assert found[column].info.description
    assert np.array_equal(found[column].value, solution.tables[table][column], equal_nan=True)


def test_every_table_has_an_astropy_table(solution):
    for name in solution.tables:
        assert len(solution.table(name)) == len(solution.tables[name])


def test_source_ids_stay_exact(solution, fit_result):
    ids = solution.table("sources")["source_id"]
    assert ids.dtype == np.int64
    assert np.array_equal(ids, fit_result.sources["source_id"])


def test_figures_are_those_of_the_dashboard_that_have_data(solution):
    names = [one.name for one in diagnostics() if one.name not in OF_COMPARISON]
    assert list(solution.figures) == names
    assert solution.figures.residual_map.title == solution.figure("residual-map").title


def test_figure_has_the_detector_and_the_theme(solution):
    figure = solution.figure("residual-map", detector=2, theme="dark")
    assert "detector 2" in figure.element.opts.get("plot").kwargs["title"]
    assert figure.__panel__().styles["background"] == "#121212"


def test_figure_has_the_selected_exposures_and_detector(solution):
    one = solution.figure("residual-map", exposures=[(0, 1)], detector=1)
    options = one.element.opts.get("plot").kwargs
    title, subtitle, _ = options["title"].split("\n")
    assert title == "Residuals on detector 1, measured minus predicted"
    assert subtitle.startswith("Field 0, exposure 1.")


def test_overview_has_every_figure(solution):
    overview = solution.show()
    assert len(overview.__panel__()[1]) == len(solution.figures)
    assert f"{len(solution.figures)} figures" in repr(overview)


def test_figure_in_a_terminal_is_text(solution):
    assert solution.figures.pulls._repr_mimebundle_() == {
        "text/plain": "figure 'pulls': Standardised residuals"
    }


def test_solution_with_another_has_the_comparison_figure(solution, make_fit_result, instrument):
    other = OpenSolution(make_fit_result(2)[0], instrument, "other", "plateviz.open('other')")
    both = solution.compared_with(other)
    assert "comparison" in both.figures
    assert "comparison" not in solution.figures
    assert "compared with order 5" in repr(both)


def test_figure_is_drawn_of_both_solutions(solution, make_fit_result, instrument):
    with pytest.raises(InputError, match="both: expected a solution to compare with"):
        solution.figure("residual-map", both=True)
    other = OpenSolution(make_fit_result(2)[0], instrument, "other", "plateviz.open('other')")
    drawn = solution.compared_with(other).figure("residual-map", both=True, detector=1)._plot()
    assert [frame.title[:3] for frame in drawn] == ["(A)", "(B)"]
    alone = [one.figure("residual-map", detector=1)._plot()[0] for one in (other, solution)]
    for frame, expected in zip(drawn, alone, strict=True):
        np.testing.assert_array_equal(frame["tails"].values("x"), expected["tails"].values("x"))


def test_any_column_is_drawn_against_any_other(solution):
    drawn = solution.explore("sources", "n_obs", "sigma_ra_marginal", only="dof", between=(9, None))
    assert repr(drawn) == "figure 'explore': sigma_ra_marginal against n_obs"
    sources = solution.result.sources.query("dof >= 9")
    marks = drawn._plot()[0]["rows by class"]
    assert sorted(marks.values("x")) == sorted(sources["n_obs"])


@pytest.mark.parametrize(
    ("rows", "x", "options", "message"),
    [
        ("stars", "ra", {}, "rows out of measurements, sources, exposures, found 'stars'"),
        ("sources", "flux", {}, "a column of the sources out of .*, found 'flux'"),
        ("sources", "ra", {"only": "flux"}, "found 'flux'"),
        ("sources", "ra", {"theme": "blue"}, "theme: expected one of light, dark"),
        ("sources", "ra", {"only": "n_obs", "between": (90, 20)}, "the lower limit first, found"),
        ("sources", "ra", {"only": "n_obs", "between": ("a", None)}, "two numbers or None, found"),
    ],
)
def test_what_is_not_there_is_not_explored(solution, rows, x, options, message):
    with pytest.raises(InputError, match=message):
        solution.explore(rows, x, "dec", **options)


@pytest.mark.usefixtures("few_figures")
def test_report_states_the_call_and_the_verdict(solution, tmp_path):
    path = solution.report(tmp_path / "r.html")
    page = path.read_text("utf-8")
    assert "plateviz.open(&#39;test&#39;).report(" in page
    assert solution.verdict.headline in page


def test_saved_solution_opens_again(solution, tmp_path):
    path = solution.save(tmp_path / "R.fits")
    again = plateviz.open(path)
    assert again.sources.equals(read_result(path).sources)
    assert again.summary["chi2"] == solution.summary["chi2"]
    assert repr(again).split("(")[0] == repr(solution).split("(")[0]


@pytest.mark.parametrize(
    ("ask", "message"),
    [
        (lambda s: s.table("source"), "table out of .*'source'; did you mean sources"),
        (lambda s: s.figure("residuals"), "figure out of footprint.*found 'residuals'"),
        (lambda s: s.figure("comparison"), "found 'comparison'"),
        (lambda s: s.figure("pulls", theme="blue"), "theme: expected one of light, dark"),
        (lambda s: s.figure("residual-map", detector=9), r"detector: expected .*, found 9"),
        (lambda s: s.figure("residual-map", exposures=[(9, 9)]), r"of the solution, .*\(9, 9\)"),
        (lambda s: s.figure("residual-map", exposures=[]), "of the solution, .*found none"),
        (lambda s: s.figure("residual-map", exposures=7), r"pairs \(field, plate\) .*found 7"),
        (lambda s: s.compared_with("R.fits"), "a solution to compare with, found 'R.fits'"),
        (lambda s: s.what_if(order=3), r"test: .* a solution alone; plateviz.open\(OBS, REF\)"),
        (lambda s: s.report("no/such/folder/r.html"), "no folder"),
        (lambda s: s.save("no/such/folder/R.fits"), "no folder"),
        (lambda s: s.report(3), "path of a file or a folder, found 3"),
    ],
    ids=lambda value: value if isinstance(value, str) else "",
)
def test_invalid_request_is_refused(solution, ask, message):
    with pytest.raises(InputError, match=message):
        ask(solution)


@pytest.mark.parametrize(
    ("code", "absent"),
    [
        ("import plateviz", "numpy pandas astropy panel holoviews bokeh jax duckdb"),
        ("import plateviz; plateviz.open", "panel holoviews bokeh jax"),
    ],
    ids=["import", "open"],
)
def test_import_is_light(code, absent):
    check = f"import sys; {code}; found = set({absent.split()!r}) & set(sys.modules)"
    subprocess.run([sys.executable, "-c", f"{check}; assert not found, found"], check=True)


def test_public_names_are_listed_and_no_others_found():
    assert {"open", "simulate", "InputError"} <= set(dir(plateviz))
    with pytest.raises(AttributeError, match="no attribute 'opened'"):
        plateviz.opened  # noqa: B018


def test_solution_of_another_instrument_is_not_compared(solution, instrument):
    result = replace(solution.result, instrument=replace(instrument, distortion_scale_um=4.2e4))
    other = replace(solution, result=result)
    with pytest.raises(InputError, match="two solutions with the same instrument to compare"):
        solution.compared_with(other)
