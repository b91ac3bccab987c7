"""AccessibleNames: names and roles for assistive technology that widgets of the libraries lack."""

from pathlib import Path

import panel as pn


class AccessibleNames(pn.custom.JSComponent):
    """An element without a size that completes the page, whenever something is added to it.

    Tables get the roles of a grid, whose pages are turned in a row of its own, fields of sliders
    get names, and headings their levels. Each rule is in `accessible_names.js`.
    """

    _esm = Path(__file__).with_suffix(".js").read_text(encoding="utf-8")
    _stylesheets = [":host { display: none; }"]
