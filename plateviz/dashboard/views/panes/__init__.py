"""Texts, strips and tables beside the figures: verdicts, remedies, comparisons.

Imports `controls` and below.
"""
