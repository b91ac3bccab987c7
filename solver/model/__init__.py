"""The observation model, one equation of the paper per file: from the sky to detector pixels.

Imports `solver.data`.
"""
