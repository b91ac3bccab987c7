"""Figures of all orbits of a run."""
