"""Figures of one source through all orbits of a run."""
