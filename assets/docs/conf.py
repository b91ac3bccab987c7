"""Configuration of Sphinx: `sphinx-build -W assets/docs SITE`; needs no network."""

import sys
from importlib import metadata
from pathlib import Path

_DOCS = Path(__file__).resolve().parent
# Describe the checkout, not an installed copy.
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

# The pages are Markdown that can be read as it is.
myst_enable_extensions = ["dollarmath"]
myst_heading_anchors = 4
html_math_renderer = "svg"

# Keep dashes and quotes of help texts as typed.
smartquotes = False

autodoc_member_order = "bysource"
autodoc_preserve_defaults = True
autodoc_typehints_format = "short"
python_maximum_signature_line_length = 80
python_use_unqualified_type_names = True
# Text in single backticks is code, and a link if an object has that name.
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
