"""Stars of Gaia DR3: one query of the archive, cached with its date.

Imports `plateviz.cache` and `solver`.
"""
