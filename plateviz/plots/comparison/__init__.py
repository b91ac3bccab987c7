"""Figures that compare two solutions, two runs, or the orders of the distortion."""
