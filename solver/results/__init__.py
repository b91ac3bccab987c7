"""What an engine found, as tables: estimates, diagnostics, eigenmodes, orders, motions.

Imports `solver.engines` and below.
"""
