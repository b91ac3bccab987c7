"""True positions of the detectors: the nominal ones, displaced once for the whole mission.

Paper, section "Survey Design": the alignment of the detectors is constant during the
mission and unknown to the fit.
"""

from dataclasses import replace

from solver.data.instrument import Instrument
from solver.simulate.settings import SurveySettings
from solver.simulate.streams import Stream


def place_detectors(instrument: Instrument, settings: SurveySettings) -> Instrument:
    """Return the true instrument, with displaced and rotated detectors and changed pitch.

    With the default settings, as in the paper, it equals the nominal instrument.
    """
    rng = settings.rng(Stream.DETECTORS)
    detectors = []
    for detector in instrument.detectors:
        x, y, rotation, pitch_x, pitch_y = rng.standard_normal(5).tolist()
        detectors.append(
            replace(
                detector,
                x_um=detector.x_um + settings.detector_offset_um * x,
                y_um=detector.y_um + settings.detector_offset_um * y,
                rotation_deg=detector.rotation_deg + settings.detector_rotation_deg * rotation,
                pitch_x_um=detector.pitch_x_um * (1.0 + settings.pitch_relative * pitch_x),
                pitch_y_um=detector.pitch_y_um * (1.0 + settings.pitch_relative * pitch_y),
            )
        )
    return replace(instrument, detectors=tuple(detectors))
