"""Figures of the calibration of an orbit: exposures, distortion, detectors and priors."""
