"""Figures as plain values, and what draws them: Bokeh models that follow new values in place.

Imports nothing of plateviz. `figure` and `glyphs` describe a figure and know neither Bokeh nor a
theme; `bokeh_figure` draws one, `holoviews_figure` converts one.
"""
