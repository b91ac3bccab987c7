"""CalibrationView: tables of the fitted calibration and the outliers, one per tab."""

from collections.abc import Callable
from typing import Any, NamedTuple

import pandas as pd
import panel as pn
import panel_material_ui as pmui
import param
from astropy.table import Table

from plateviz.dashboard.saving.calibration_files import calibration_files
from plateviz.dashboard.session.session import Session
from plateviz.dashboard.views.cards.state_text import empty_text, outdated_text
from plateviz.dashboard.views.elements.markup import markup_pane, paragraph
from plateviz.dashboard.views.elements.table import TABLE_STYLE, short_cells
from plateviz.dashboard.views.saving.save_button import SaveButton
from plateviz.dashboard.views.saving.save_choices import table_choices
from plateviz.tables import calibration_tables, outlier_list
from solver.data.subset import KINDS


class _Rows(NamedTuple):
    """A table whose rows can be selected.

    Attributes
    ----------
    table : on the screen
    kind : of `Subset` that a row is of
    items : what each row is of
    """

    table: pn.widgets.Tabulator
    kind: str
    items: list[Any]


class CalibrationView(pn.viewable.Viewer):
    """Tables of exposures, detectors, distortion and outliers of the solution on the screen.

    Their rows are selected with those of the figures: exposures, detectors, and the sources of
    outliers.
    """

    def __init__(self, session: Session, **params: object) -> None:
        """Follow `session`."""
        super().__init__(**params)
        self._session = session
        self._rows: list[_Rows] = []
        self._is_showing = False
        # Otherwise a table in an unopened tab would check in the browser without end whether it can
        # be laid out, which uses one core.
        self._tabs = pmui.Tabs(dynamic=True, sizing_mode="stretch_width")
        self._words = markup_pane()
        # Above the tabs: its menu would be cut off at the end of the card.
        self._save = SaveButton("calibration", table_choices(self._subject, self._files))
        self._column = pmui.Column(
            self._words, self._save, self._tabs, margin=0, sizing_mode="stretch_width"
        )
        session.param.watch(self._fill, "shown")
        session.param.watch(self._say, ["shown", "stage", "is_brief", "theme"])
        session.selection.param.watch(self._show_selected, [*KINDS])
        self._fill()
        self._say()

    def __panel__(self) -> pn.viewable.Viewable:
        """Return the tabs, below words on their state unless they are of the requested solution."""
        return self._column

    def _say(self, *_: object) -> None:
        session = self._session
        is_missing = session.shown is None
        text = empty_text(session) if is_missing else outdated_text(session)
        self._words.object = paragraph(text, "empty" if is_missing else "outdated", session.theme)
        self._words.visible = bool(text)
        self._tabs.visible = self._save.visible = not is_missing
        self._save.theme = session.theme

    def _subject(self) -> str:
        return f"{self._session.shown_part.subject()}-calibration"

    def _files(self) -> dict[str, Table]:
        shown = self._session.shown
        return {} if shown is None else calibration_files(shown.result)

    def _fill(self, *_: object) -> None:
        shown = self._session.shown
        self._rows = []
        if shown is None:
            self._tabs[:] = []
            return
        tables, outliers = calibration_tables(shown.result), outlier_list(shown.result)
        exposures = shown.result.exposures[["field_id", "plate_id"]].to_numpy().tolist()
        items: dict[str, tuple[str, list[Any]]] = {
            "Exposures": ("exposures", [(field, plate) for field, plate in exposures]),
            "Detectors": (
                "detectors",
                [one.detector_id for one in self._session.store.instrument.detectors],
            ),
        }
        if outliers is not None:
            title = f"Outliers ({len(outliers)})"
            tables[title] = outliers
            items[title] = ("sources", outliers["source"].astype("int64").tolist())
        self._tabs[:] = [
            (title, self._table(table, items.get(title))) for title, table in tables.items()
        ]
        self._show_selected()

    def _table(
        self, rows: pd.DataFrame, items: tuple[str, list[Any]] | None
    ) -> pn.widgets.Tabulator:
        table = pn.widgets.Tabulator(
            rows,
            disabled=True,
            show_index=False,
            selectable=False if items is None else "checkbox",
            pagination="remote",
            page_size=12,
            formatters={name: short_cells(name) for name in rows.select_dtypes("float")},
            text_align={name: "right" for name in rows.select_dtypes("number")},
            layout="fit_data_fill",
            sizing_mode="stretch_width",
            stylesheets=[TABLE_STYLE],
        )
        if items is not None:
            self._rows.append(_Rows(table, *items))
            table.param.watch(self._take(self._rows[-1]), "selection")
        return table

    def _take(self, rows: _Rows) -> Callable[[param.parameterized.Event], None]:
        def take(event: param.parameterized.Event) -> None:
            if not self._is_showing:
                # They come from the browser.
                chosen = (rows.items[row] for row in event.new if 0 <= row < len(rows.items))
                setattr(self._session.selection, rows.kind, frozenset(chosen))

        return take

    def _show_selected(self, *_: object) -> None:
        self._is_showing = True
        try:
            for table, kind, items in self._rows:
                selected = getattr(self._session.selection, kind)
                table.selection = [row for row, item in enumerate(items) if item in selected]
        finally:
            self._is_showing = False
