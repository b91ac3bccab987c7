"""Figures of the weak directions of an orbit: the eigenmodes of its calibration."""
