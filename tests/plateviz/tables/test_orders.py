"""The comparison of the orders: table, sentence, figure, command line and refit panel."""

from dataclasses import replace
from types import SimpleNamespace

import holoviews as hv
import numpy as np
import panel_material_ui as pmui
import pytest
from bokeh.models import Plot

from plateviz import plots, tables
from plateviz.cli.output import print_orders
from plateviz.dashboard.session import Session
from plateviz.dashboard.views.refit import RefitView
from plateviz.tables.orders import preferred_order
from solver.data.instrument import MINI_MOCK


@pytest.fixture(scope="module")
def table(compared):
    return tables.order_comparison(compared)


def only(result, highest):
    """Return the comparison of the orders up to `highest`."""
    kept = result.orders[result.orders["order"] <= highest]
    return tables.order_comparison(replace(result, orders=kept))


def figures(table):
    found = hv.render(plots.plot_orders(table), backend="bokeh").select({"type": Plot})
    return sorted(found, key=lambda figure: not figure.title.text.startswith("Evidence"))


def subtitle(figure):
    return " ".join(title.text for title in figure.above)


def labels(figure):
    return list(figure.yaxis[0].major_label_overrides.values())


def test_without_a_comparison_the_table_is_empty(fit_result):
    assert tables.order_comparison(fit_result).empty


def test_differences_are_to_the_best_order(table):
    assert table["evidence_below_best"].min() == table["log_density_below_best"].min() == 0.0
    assert preferred_order(table, "evidence_below_best") == 5
    assert preferred_order(table, "log_density_below_best") == 6
    sixth = table[table["order"] == 6].iloc[0]
    assert sixth["evidence_below_best"] == pytest.approx(5.0)


def test_scatter_of_the_reserved_sources_is_that_of_chi2(table):
    np.testing.assert_allclose(table["held_out_sd"], np.sqrt(2.0 / 7000.0))
    assert table["held_out_chi2_per_dof"].iloc[5] == 1.0


def test_fitted_order_is_marked(table):
    assert table.loc[table["is_fitted"], "order"].tolist() == [5]


def test_lowest_of_equally_good_orders_is_preferred(table):
    equal = table.assign(evidence_below_best=[1.0, 1.0, *[0.0] * 8])
    assert preferred_order(equal, "evidence_below_best") == 2


EVIDENCE, DENSITY = "evidence_below_best", "log_density_below_best"


@pytest.mark.parametrize(
    ("changes", "fitted", "expected"),
    [
        (
            {},
            5,
            "Order 5 has the highest evidence; order 6 predicts the reserved sources best, "
            "with a log density higher by 0.5; the fitted order is 5.",
        ),
        ({}, 3, "the fitted order is 3, which is neither."),
        (
            {DENSITY: EVIDENCE},
            5,
            "Order 5 has the highest evidence and predicts the reserved "
            "sources best; this is the fitted order.",
        ),
        ({DENSITY: EVIDENCE}, 4, "sources best; the fitted order is 4."),
        (
            {EVIDENCE: None},
            6,
            "Order 6 predicts the reserved sources best (the evidence is undefined "
            "under a flat prior); this is the fitted order.",
        ),
        ({DENSITY: None}, 5, "Order 5 has the highest evidence; this is the fitted order."),
        (
            {EVIDENCE: None, DENSITY: None},
            5,
            "No criterion distinguishes the orders; the fitted order is 5.",
        ),
    ],
    ids=["differ", "neither", "agree", "another", "flat", "none-reserved", "nothing"],
)
def test_order_verdict_is_one_sentence(table, changes, fitted, expected):
    changed = table.assign(
        is_fitted=table["order"] == fitted,
        **{name: table[other] if other else np.nan for name, other in changes.items()},
    )
    assert tables.order_verdict(changed).endswith(expected)


@pytest.mark.parametrize(
    ("highest", "expected"),
    [(9, ""), (8, " Order 9 is left out: it has"), (6, " Orders 7 to 9 are left out: they have")],
)
def test_orders_that_the_data_cannot_constrain_are_named(compared, highest, expected):
    _, _, rest = tables.order_verdict(only(compared, highest)).partition("order is 5.")
    assert rest.startswith(expected)
    assert bool(rest) == bool(expected)


def test_figure_names_the_best_orders_and_the_fitted_one(table):
    worth, held_out = figures(table)
    assert "best evidence: order 5; best prediction: order 6" in subtitle(worth)
    assert "fitted: order 5, dotted" in subtitle(worth)
    assert "too few data" not in subtitle(worth)
    assert "24 sources" in subtitle(held_out)
    assert "1 ± 0.017" in subtitle(held_out)


def test_figure_names_the_highest_order_that_the_data_constrain(compared):
    worth, _ = figures(only(compared, 6))
    assert "above 6 too few data" in subtitle(worth)


def test_ticks_resolve_both_large_and_small_differences(table):
    worth, held_out = figures(table)
    assert {"0", "−10", "−1,000", "−1,000,000"} <= set(labels(worth))
    assert {"1", "1.05", "5", "100"} <= set(labels(held_out))
    for figure in (worth, held_out):
        places = np.array([float(tick) for tick in figure.yaxis[0].ticker.ticks])
        assert np.diff(np.sort(places)).min() >= 0.08 * (figure.y_range.end - figure.y_range.start)


def test_band_is_two_sigma_wide(table):
    elements = list(list(plots.plot_orders(table))[1])
    band = next(e for e in elements if isinstance(e, hv.Area)).dframe()
    rows = next(e for e in elements if isinstance(e, hv.Points)).dframe()
    scale = 2.0 * np.sqrt(2.0 / 7000.0)
    assert np.sinh(band["high"].iloc[0]) * scale == pytest.approx(scale)
    np.testing.assert_allclose(
        1.0 + np.sinh(rows["height"]) * scale, table["held_out_chi2_per_dof"]
    )


def test_fitted_order_is_a_line_in_both_panels(table):
    for panel in plots.plot_orders(table):
        assert [e.data for e in panel if isinstance(e, hv.VLine)] == [5]


def test_no_evidence_leaves_one_curve(table):
    worth = next(iter(plots.plot_orders(table.assign(evidence_below_best=np.nan))))
    names = [e.label for e in worth if isinstance(e, hv.Curve)]
    assert names == ["log density of the reserved sources"]


def test_panel_without_reserved_sources_has_a_message(table):
    columns = {c: np.nan for c in ("held_out_chi2_per_dof", "log_density_below_best")}
    _, held_out = figures(table.assign(**columns))
    assert any("No reserved" in str(r.data_source.data.get("text", "")) for r in held_out.renderers)


def test_command_line_prints_a_row_for_every_order_and_the_verdict(compared, capsys):
    table = tables.order_comparison(compared).assign(evidence_below_best=np.nan)
    rows = table.astype(object).where(table.notna(), None).to_dict("records")
    print_orders(rows, "Order 5 it is.")
    lines = [line.split() for line in capsys.readouterr().out.splitlines() if line.strip()]
    printed = {words[0]: words for words in lines}
    assert set("0123456789") <= set(printed)
    assert printed["5"] == ["5", "*", "36", "1.0005", "-", "1.0000", "±", "0.0169", "0.5"]
    assert lines[-1] == ["*", "fitted.", "Order", "5", "it", "is."]


def test_refit_panel_has_a_switch_for_the_comparison(fit_result):
    store = SimpleNamespace(orbits=(0,), instrument=MINI_MOCK)
    session = Session(store)
    (switch,) = (
        widget
        for widget in RefitView(session).__panel__().select(pmui.Switch)
        if widget.label == "Compare all orders"
    )
    assert not session.choices.settings().compare_orders
    switch.value = True
    assert session.choices.settings().compare_orders
