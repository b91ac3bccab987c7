"""SelectionActions: what can be done with the selection of a session, without Panel."""

from contextlib import suppress

from plateviz.dashboard.selection.selected import checked_name
from plateviz.dashboard.session.session import Session
from plateviz.dashboard.session.solution import Solution
from plateviz.dashboard.session.without_what_if import what_to_do
from plateviz.runs.kept_selections import TakenError
from solver.data.settings import FitSettings
from solver.data.subset import KINDS, NOTHING, Subset
from solver.errors import InputError

_NOT_MEASURED = (
    "The orbit on the screen has measured nothing of the selection. Open an orbit that has, or "
    "select something else."
)
# Selections that a session keeps.
_MOST_KEPT = 50


class SelectionActions:
    """Invert, leave out, put back, keep and take up the selection of a session."""

    def __init__(self, session: Session) -> None:
        """Act on `session`."""
        self._session, self._selection = session, session.selection
        self._known: tuple[Solution | None, Subset] = (None, NOTHING)
        session.param.watch(self._forget_advice, "shown")
        session.choices.param.watch(self._forget_advice, "exclusions")
        session.selection.param.watch(self._forget_refusal, [*KINDS])

    @property
    def in_orbit(self) -> Subset:
        """The part of the selection that the orbit on the screen has measured."""
        return self._selection.selected & self._measured

    @property
    def is_left_out(self) -> bool:
        """Whether the next fit uses nothing of the selection, though some is measured."""
        return bool(self.in_orbit) and self.in_orbit <= self._left_out

    def clear(self) -> None:
        """Select nothing."""
        self._selection.select(NOTHING)

    def invert(self) -> None:
        """Select the others of the orbit on the screen, of each kind that is selected."""
        selected = self._selection.selected
        self._selection.select(self._measured.of_kinds(selected.kinds) - selected)

    def leave_out(self) -> None:
        """Exclude the selection from the next fit, which shows a what-if, or say what to do."""
        if not self.in_orbit:
            self._session.advice = _NOT_MEASURED
            return
        self._exclude(self._left_out | self.in_orbit)

    def without_selected(self, settings: FitSettings) -> FitSettings:
        """Return settings with which the selection is left out, too."""
        left_out = settings.exclusions | self.in_orbit
        return settings.with_(exclusions=left_out)

    def put_back(self) -> None:
        """Include the selection in the next fit, which shows a what-if, or say what to do."""
        self._exclude(self._left_out - self._selection.selected)

    def keep(self, name: str) -> str:
        """Keep the selection under a name, in place of one that has that name.

        Returns
        -------
        Why it is kept in this session only; empty if it is on disk.

        Raises
        ------
        InputError
            If the name is invalid or somebody else has kept another selection under it, nothing is
            selected, or too many are kept.
        """
        name, kept = checked_name(name), self._selection.kept
        if not self._selection.selected:
            raise InputError("nothing is selected that could be kept")
        if name not in kept and len(kept) >= _MOST_KEPT:
            raise InputError(f"{_MOST_KEPT} selections are kept; forget one first")
        selected, before = self._selection.selected, kept.get(name)
        why = ""
        try:
            self._session.store.selections.keep(name, selected, before)
        except TakenError:
            raise
        except InputError as error:
            why = str(error)
        # First, since the first name of a selection is that of the address.
        self._selection.kept = {name: selected} | {
            one: items for one, items in kept.items() if one != name
        }
        return why

    def take_up(self, name: str) -> None:
        """Select again what is kept under a name; nothing happens if there is none."""
        if name in self._selection.kept:
            self._selection.select(self._selection.kept[name])

    def forget(self, name: str) -> None:
        """Keep nothing under a name any more; what is selected stays selected."""
        kept = self._selection.kept
        if name in kept:
            # What cannot be written is forgotten in this session.
            with suppress(InputError):
                self._session.store.selections.forget(name, kept[name])
        self._selection.kept = {one: items for one, items in kept.items() if one != name}

    @property
    def _measured(self) -> Subset:
        """What the orbit on the screen has measured, that which is left out included."""
        shown = self._session.shown
        if self._known[0] is not shown:
            self._known = (shown, NOTHING if shown is None else _measured(shown))
        return self._known[1]

    @property
    def _left_out(self) -> Subset:
        try:
            return self._session.choices.settings().exclusions
        except InputError:
            return NOTHING

    def _exclude(self, left_out: Subset) -> None:
        choices = self._session.choices
        try:
            settings = choices.settings()
        except InputError as error:
            # Other settings than exclusions may be invalid; nothing is changed for them.
            self._session.refuse(str(error))
            return
        settings = settings.with_(exclusions=left_out)
        choices.load(settings)
        self._advise(settings)

    def _advise(self, settings: FitSettings) -> None:
        """Say what to do for the settings of the controls to take effect."""
        session = self._session
        is_shown = session.shown is not None and session.shown.settings == settings
        needed = "" if is_shown and not session.is_fitting else what_to_do(session, settings.engine)
        what = "What is left out of the fit has changed in its settings only"
        session.advice = f"{what}; {needed}." if needed else ""

    def _forget_advice(self, *_: object) -> None:
        shown = self._session.shown
        if shown is not None and shown.settings.exclusions == self._left_out:
            self._session.advice = ""

    def _forget_refusal(self, *_: object) -> None:
        if self._session.advice == _NOT_MEASURED:
            self._session.advice = ""


def look_for_kept(session: Session) -> None:
    """Take over what others have kept by now; a notice says where it cannot be read."""
    selection = session.selection
    try:
        found = session.store.selections.all()
    except InputError as error:
        session.note([str(error)])
        return
    kept = {}
    for name, items in found.items():
        # They come from a file.
        with suppress(InputError):
            kept[checked_name(name)] = items
    merged = {**selection.kept, **kept}
    if merged != selection.kept:
        selection.kept = merged


def _measured(solution: Solution) -> Subset:
    result = solution.result
    exposures = result.exposures[["field_id", "plate_id"]].itertuples(index=False)
    return (
        Subset(
            frozenset(result.sources["source_id"].tolist()),
            frozenset((int(field), int(plate)) for field, plate in exposures),
            frozenset(result.residuals["detector_id"].unique().tolist()),
        )
        | solution.settings.exclusions
    )
