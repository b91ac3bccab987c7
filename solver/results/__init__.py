"""Result tables of an engine: estimates, diagnostics, eigenmodes, orders, motions.

Imports `solver.engines` and below.
"""
