"""The observation model, from the sky to detector pixels; one equation of the paper per file.

Imports `solver.data`.
"""
