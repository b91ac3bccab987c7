"""Figures on cards, grids of them, and the workspaces that these fill.

Imports `saving` and below.
"""
