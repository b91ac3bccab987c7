"""The comparison of the orders: table, sentence, figure, command line and refit panel."""

from dataclasses import replace

import numpy as np
import panel_material_ui as pmui
import pytest

from plateviz import plots, tables
from plateviz.cli.output import print_orders
from plateviz.dashboard.navigation.navigation import Navigation
from plateviz.dashboard.session.session import Session
from plateviz.dashboard.views.controls.refit import RefitView
from plateviz.tables.orders import preferred_order
from tests.plateviz.dashboard.fake_survey import SurveyStore


@pytest.fixture(scope="module")
def table(compared):
    return tables.order_comparison(compared)


def only(result, highest):
    """Return the comparison of the orders up to `highest`."""
    kept = result.orders[result.orders["order"] <= highest]
    return tables.order_comparison(replace(result, orders=kept))


def labels(axis):
    return [label for _, label in axis.ticks]


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
    worth, held_out = plots.plot_orders(table)
    assert "best evidence: order 5; best prediction: order 6" in worth.subtitle
    assert "fitted: order 5, dotted" in worth.subtitle
    assert "too few data" not in worth.subtitle
    assert "24 sources" in held_out.subtitle
    assert "1 ± 0.017" in held_out.subtitle


def test_figure_names_the_highest_order_that_the_data_constrain(compared):
    worth, _ = plots.plot_orders(only(compared, 6))
    assert "above 6 too few data" in worth.subtitle


def test_ticks_resolve_both_large_and_small_differences(table):
    worth, held_out = plots.plot_orders(table)
    assert {"0", "−10", "−1,000", "−1,000,000"} <= set(labels(worth.y))
    assert {"1", "1.05", "5", "100"} <= set(labels(held_out.y))
    for frame in (worth, held_out):
        places = np.array([place for place, _ in frame.y.ticks])
        assert np.diff(np.sort(places)).min() >= 0.08 * frame.y.length


def test_every_order_has_a_tick(table):
    for frame in plots.plot_orders(table):
        assert labels(frame.x) == [str(order) for order in range(10)]


def test_band_is_two_sigma_wide(table):
    _, frame = plots.plot_orders(table)
    heights = frame["reserved sources, marks"].values("y")
    scale = 2.0 * np.sqrt(2.0 / 7000.0)
    assert np.sinh(frame["band"].values("y2")[0]) * scale == pytest.approx(scale)
    assert np.sinh(frame["band"].values("y1")[0]) * scale == pytest.approx(-scale)
    np.testing.assert_allclose(1.0 + np.sinh(heights) * scale, table["held_out_chi2_per_dof"])


def test_fitted_order_is_a_line_in_both_panels(table):
    for frame in plots.plot_orders(table):
        assert frame["fitted"].kind == "vertical"
        assert frame["fitted"].values("x").tolist() == [5]


def test_no_evidence_leaves_one_curve(table):
    worth, _ = plots.plot_orders(table.assign(evidence_below_best=np.nan))
    names = [glyphs.label for glyphs in worth.glyphs if glyphs.kind == "line"]
    assert names == ["log density of the reserved sources"]


def test_panel_without_reserved_sources_has_a_message(table):
    columns = {c: np.nan for c in ("held_out_chi2_per_dof", "log_density_below_best")}
    _, held_out = plots.plot_orders(table.assign(**columns))
    (text,) = held_out["message"].values("text")
    assert text == "No reserved sources"


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
    navigation = Navigation(Session(SurveyStore(fit_result, [])))
    session = navigation.session
    (switch,) = (
        widget
        for widget in RefitView(navigation).__panel__().select(pmui.Switch)
        if widget.label == "Compare all orders"
    )
    assert not session.choices.settings().compare_orders
    switch.value = True
    assert session.choices.settings().compare_orders
