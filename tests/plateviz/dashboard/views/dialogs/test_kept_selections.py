"""KeptSelectionsDialog: where its parts are."""

from plateviz.dashboard.views.controls.selection_bar import SelectionBar
from plateviz.dashboard.views.dialogs.kept_selections import KeptSelectionsDialog


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
