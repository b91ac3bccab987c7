"""Stars of Gaia DR3: one query of the archive, kept in the cache with its date.

Imports `plateviz.cache` and `solver`.
"""
