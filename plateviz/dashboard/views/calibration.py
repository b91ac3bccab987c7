"""CalibrationView: tables of the fitted calibration and the outliers, one per tab."""

import panel as pn
import panel_material_ui as pmui

from plateviz.dashboard.session import Session
from plateviz.dashboard.views.table import TABLE_STYLE
from plateviz.tables import calibration_tables, outlier_list


class CalibrationView(pn.viewable.Viewer):
    """Tables of exposures, detectors, distortion and outliers of the solution on the screen."""

    def __init__(self, session: Session, **params: object) -> None:
        """Follow `session`."""
        super().__init__(**params)
        self._session = session
        # Otherwise a table in an unopened tab would check in the browser without end whether it can
        # be laid out, which uses one core.
        self._tabs = pmui.Tabs(dynamic=True, sizing_mode="stretch_width")
        session.param.watch(self._fill, "shown")
        self._fill()

    def __panel__(self) -> pn.viewable.Viewable:
        """Return the tabs."""
        return self._tabs

    def _fill(self, *_: object) -> None:
        shown = self._session.shown
        tables = calibration_tables(shown.result) if shown else {}
        outliers = outlier_list(shown.result) if shown else None
        if outliers is not None:
            tables[f"Outliers ({len(outliers)})"] = outliers
        self._tabs[:] = [
            (
                title,
                pn.widgets.Tabulator(
                    table,
                    disabled=True,
                    show_index=False,
                    pagination="remote",
                    page_size=12,
                    layout="fit_data_fill",
                    sizing_mode="stretch_width",
                    stylesheets=[TABLE_STYLE],
                ),
            )
            for title, table in tables.items()
        ]
