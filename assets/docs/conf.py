"""How the site is built: `sphinx-build -W assets/docs SITE`. It fetches nothing, then or later."""

import sys
from importlib import metadata
from pathlib import Path

_DOCS = Path(__file__).resolve().parent
# The repository is described, not the copy that was installed before the last edit.
sys.path[:0] = [str(_DOCS / "extensions"), str(_DOCS.parents[1])]

project = "plateviz"
author = "plateviz developers"
try:
    release = metadata.version("plateviz")
except metadata.PackageNotFoundError:
    release = ""

extensions = [
    "myst_parser",
    "sphinx.ext.autodoc",
    "command_reference",
    "docstrings",
    "equations",
    "schema_reference",
]
exclude_patterns = ["extensions", "figures", "static"]

# The pages are Markdown that a forge shows as well.
myst_enable_extensions = ["dollarmath"]
myst_heading_anchors = 4
html_math_renderer = "svg"

# Dashes and quotes of help texts stay what people type.
smartquotes = False

autodoc_member_order = "bysource"
autodoc_preserve_defaults = True
autodoc_typehints_format = "short"
python_maximum_signature_line_length = 80
python_use_unqualified_type_names = True
# Words in single backticks are code, and a link where there is something of that name.
default_role = "py:obj"
add_module_names = False
toc_object_entries_show_parents = "hide"

html_theme = "furo"
html_title = f"plateviz {release}".strip()
html_static_path = ["static"]
html_css_files = ["site.css"]
html_copy_source = False
html_show_sourcelink = False
html_show_sphinx = False
html_show_copyright = False
