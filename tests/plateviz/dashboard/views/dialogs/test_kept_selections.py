"""KeptSelectionsDialog: where its parts are, and what is said before something is lost."""

from plateviz.dashboard.views.controls.selection_bar import SelectionBar
from plateviz.dashboard.views.dialogs.kept_selections import KeptSelectionsDialog
from solver.data.subset import Subset


def test_all_parts_begin_at_the_same_place_and_none_touches_the_next(navigation):
    window = KeptSelectionsDialog(navigation)
    above, _, below, left = window._words.margin
    fields = [window._name.margin, window._kept.margin]
    assert [across for _, across in fields] == [left, left]
    # A label stands on the upper border of a field.
    assert all(below + field_above >= 16 for field_above, _ in fields)
    assert above == 0


def test_bar_stays_clear_of_the_title_whatever_it_begins_with(navigation):
    *_, left = SelectionBar(navigation).__panel__().margin
    assert left >= 16


def test_what_is_kept_under_a_name_is_not_replaced_without_a_question(navigation):
    window, selection = KeptSelectionsDialog(navigation), navigation.session.selection
    theirs, mine = Subset(detectors=frozenset({1})), Subset(detectors=frozenset({2, 3}))
    selection.kept = {"corner": theirs}
    selection.select(mine)
    window.open()
    window._name.value_input = " corner"
    window._keep.clicks += 1
    assert selection.kept == {"corner": theirs}
    assert "another selection: detector 1. Press Keep again" in window._words.object
    # What has been selected meanwhile is another question.
    selection.select(Subset(detectors=frozenset({4})))
    window._keep.clicks += 1
    assert selection.kept == {"corner": theirs}
    window._keep.clicks += 1
    assert selection.kept == {"corner": Subset(detectors=frozenset({4}))}
    assert "Kept under the name" in window._words.object


def test_newest_name_of_a_selection_is_that_which_is_chosen(navigation):
    window, selection = KeptSelectionsDialog(navigation), navigation.session.selection
    selection.select(Subset(detectors=frozenset({1})))
    window.open()
    for name in ("corner", "lower left"):
        window._name.value_input = name
        window._keep.clicks += 1
    assert window._kept.value == selection.name_of_selected == "lower left"
