"""Render equations as SVG in the page, so that no script, font or network is needed."""

from html import escape

from docutils import nodes
from sphinx.application import Sphinx
from sphinx.util import logging
from sphinx.writers.html5 import HTML5Translator
from ziamath.config import config
from ziamath.zmath import Latex

_LOGGER = logging.getLogger(__name__)
# Font sizes in pixels, to match the theme's text.
_SIZE = 17.0
_INLINE_SIZE = 16.0


def setup(app: Sphinx) -> dict[str, bool]:
    """Register the math renderer named in conf.py."""
    # Without shared glyphs: two equations of a page would overwrite each other's by name.
    config.svg2 = False
    config.math.color = "currentColor"
    app.add_html_math_renderer("svg", (_visit_inline, None), (_visit_block, None))
    return {"parallel_read_safe": True, "parallel_write_safe": True}


def svg(text: str, *, inline: bool) -> str:
    """Return a LaTeX equation as SVG, with its source as the label for screen readers."""
    drawn = Latex(text, size=_INLINE_SIZE if inline else _SIZE, inline=inline)
    below = f"vertical-align: {drawn.getyofst():.2f}px" if inline else ""
    label = escape(" ".join(text.split()), quote=True)
    opening = f'<svg class="equation" role="img" aria-label="{label}" style="{below}" '
    return drawn.svg().replace("<svg ", opening, 1)


def _visit_inline(translator: HTML5Translator, node: nodes.math) -> None:
    translator.body.append(_or_warning(node, inline=True))
    raise nodes.SkipNode


def _visit_block(translator: HTML5Translator, node: nodes.math_block) -> None:
    translator.body.append(f'<div class="equation">{_or_warning(node, inline=False)}</div>')
    raise nodes.SkipNode


def _or_warning(node: nodes.Element, *, inline: bool) -> str:
    text = node.astext()
    try:
        return svg(text, inline=inline)
    except (ValueError, LookupError, TypeError, AttributeError) as error:
        _LOGGER.warning("equation %r cannot be drawn: %r", text, error, location=node)
        return escape(text)
