"""Figures of the residuals of an orbit: maps, distributions, patterns and trends."""
