"""Figures of an orbit on the sky: positions, their deviations and uncertainties."""
