"""Quick components: what Panel works out anew for every component of a page, worked out seldom.

For its model, a component reads each of its parameters. Param then makes a copy of it for the
component, in case that somebody changes it: a fifteenth of the server's time for a page. Panel also
looks for the files of the component's class on the disk, and at each change of a picture or a text
for those of the theme. Each time a part of a page changes, it goes through the whole page five
times, for what is linked in the browser.
"""

from collections.abc import Callable
from contextvars import ContextVar
from functools import cache, wraps
from typing import Any

import panel as pn
from panel.custom import ReactiveESM
from panel.util import classproperty
from panel.viewable import Viewable
from panel_material_ui.theme import MaterialDesign
from param import parameterized

# They have no public names. A test, run with the newest versions too, notices a change.
_PARAM: Any = parameterized
_COMPONENT: Any = ReactiveESM
_VIEWABLE: Any = Viewable
_DESIGN: Any = MaterialDesign
_METHODS = ("_get_model", "_get_properties")
# The component whose model is made.
_READING: ContextVar[Any] = ContextVar("reading", default=None)


def make_components_quick() -> None:
    """Let a component of this process read the parameters of its class to make its model.

    Those that are its own it has been given before. Other objects are not concerned, even if their
    models are made meanwhile.
    """
    instantiated = _PARAM._instantiated_parameter  # noqa: SLF001
    if hasattr(instantiated, "__wrapped__"):
        return

    @wraps(instantiated)
    def read(owner: Any, parameter: Any) -> Any:  # noqa: ANN401 as Param
        if owner is _READING.get():
            own = owner._param__private.params  # noqa: SLF001
            return own.get(parameter.name, parameter)
        return instantiated(owner, parameter)

    _PARAM._instantiated_parameter = read  # noqa: SLF001
    for name in _METHODS:
        setattr(_COMPONENT, name, _reading(getattr(_COMPONENT, name)))
    # The files of a class are where they were.
    find = vars(ReactiveESM)["_bundle_path"].f
    _COMPONENT._bundle_path = classproperty(cache(find))  # noqa: SLF001
    _DESIGN._get_modifiers = classmethod(_remembering(_DESIGN._get_modifiers.__func__))  # noqa: SLF001
    # Of HoloViews, ECharts and methods of Param, which are linked, a page has none.
    _VIEWABLE._preprocessing_hooks.clear()  # noqa: SLF001


def _reading(method: Callable) -> Callable:
    @wraps(method)
    def reading(component: ReactiveESM, *arguments: object, **named: object) -> object:
        token = _READING.set(component)
        try:
            return method(component, *arguments, **named)
        finally:
            _READING.reset(token)

    return reading


def _remembering(find: Callable) -> Callable:
    """Return a method that finds once what a design gives all viewables of a class."""
    known: dict[tuple, tuple[dict, dict]] = {}

    @wraps(find)
    def modifiers(design: type, viewable: Viewable, theme: object, isolated: Any = None) -> Any:  # noqa: ANN401 as Panel
        document = pn.state.curdoc
        is_served = bool(document and document.session_context)
        theme_type = theme if isinstance(theme, type) else type(theme)
        key = design, type(viewable), theme_type, isolated, is_served
        if key not in known:
            known[key] = find(design, viewable, theme, isolated)
        # The caller adds to them.
        own, of_children = known[key]
        return dict(own), dict(of_children)

    return modifiers
