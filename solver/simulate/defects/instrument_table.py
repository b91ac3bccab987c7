"""Defects of the instrument: its focal plane, its detectors and its noise."""

from solver.simulate.defects import detectors, noise, optics
from solver.simulate.defects.defect import Defect, DefectStage

INSTRUMENT_DEFECTS = (
    Defect(
        name="distortion-drift",
        label="distortion that drifts",
        unit="um",
        example="0.1um",
        does="The quadratic terms change linearly with time. Amplitude: change of the six "
        "coefficients from the first exposure to the last, root of the sum of squares.",
        stands_for="slow thermal deformation of the optics, which Plate Analysis neglects "
        "(paper, section Plate Analysis)",
        reference="Anderson 2007, ACS ISR 2007-08 (drift of the distortion of HST's ACS)",
        stage=DefectStage.FOCAL_PLANE,
        apply=optics.distortion_drift,
        high=1e3,
    ),
    Defect(
        name="distortion-orbital",
        label="distortion that follows the orbital phase",
        unit="um",
        example="0.1um",
        does="The quadratic terms oscillate with the period of the satellite's orbit, 97 min, at a "
        "random phase. Amplitude: that of the six coefficients, root of the sum of squares.",
        stands_for="irradiation by the Earth from changing angles (paper, introduction); "
        "the breathing of HST",
        reference="Lallo et al. 2006, Proc. SPIE 6270, 62701N",
        stage=DefectStage.FOCAL_PLANE,
        apply=optics.distortion_orbital,
        high=1e3,
    ),
    Defect(
        name="distortion-step",
        label="step of the distortion between fields",
        unit="um",
        example="50nm",
        does="The cubic terms change between the first and the second half of the fields. "
        "Amplitude: change of the eight coefficients, root of the sum of squares.",
        stands_for="stress that is released when the satellite turns to another field; "
        "jumps of Gaia's basic angle",
        reference="Lindegren et al. 2018, A&A 616, A2",
        stage=DefectStage.FOCAL_PLANE,
        apply=optics.distortion_step,
        high=1e3,
    ),
    Defect(
        name="distortion-trend",
        label="distortion that changes from orbit to orbit",
        unit="um",
        example="50nm",
        does="The quadratic terms change linearly with the number of the orbit, and are constant "
        "within each. Amplitude: change of the six coefficients from the first orbit of the survey "
        "to the last, root of the sum of squares.",
        stands_for="ageing of the optics, outgassing; each orbit alone is without flaw",
        reference="Anderson 2007, ACS ISR 2007-08 (drift of the distortion of HST's ACS)",
        stage=DefectStage.FOCAL_PLANE,
        apply=optics.distortion_trend,
        high=1e3,
    ),
    Defect(
        name="focal-trend",
        label="focal length that changes from orbit to orbit",
        unit="ppm",
        example="3000ppm",
        does="The focal length changes linearly with the number of the orbit, beside its scatter, "
        "1e-3 between orbits. Amplitude: change from the first orbit of the survey to the last.",
        stands_for="ageing and cooling of the telescope; each orbit alone is without flaw",
        reference="Lallo et al. 2006, Proc. SPIE 6270, 62701N (focus of HST over years)",
        stage=DefectStage.FOCAL_PLANE,
        apply=optics.focal_trend,
        low=-1e4,
        high=1e4,
    ),
    Defect(
        name="distortion-order",
        label="distortion of higher order than fitted",
        unit="um",
        example="50nm",
        does="Terms of degree 6 and 7 are added, above the default order of a fit. Amplitude: the "
        "fifteen pairs of coefficients, root of the sum of squares.",
        stands_for="polishing errors of the mirrors; the fine structure that HST's and Euclid's "
        "polynomials leave",
        reference="Bellini et al. 2011, PASP 123, 622; Libralato et al. 2024, A&A 692, A96",
        stage=DefectStage.FOCAL_PLANE,
        apply=optics.distortion_order,
        high=1e3,
    ),
    Defect(
        name="focal-anisotropy",
        label="focal length that differs between the axes",
        unit="ppm",
        example="2ppm",
        does="The focal length along y over that along x differs from one by a normal deviate of "
        "each exposure; their mean is unchanged. Amplitude: its standard deviation.",
        stands_for="astigmatic deformation; the published code fits a focal length for each axis",
        reference="Anderson 2007, ACS ISR 2007-08 (linear terms of HST's ACS)",
        stage=DefectStage.FOCAL_PLANE,
        apply=optics.focal_anisotropy,
        high=1e4,
    ),
    Defect(
        name="pointing-jitter",
        label="pointing that jitters in some exposures",
        unit="mas",
        example="4mas",
        does="In one exposure of 32, the telescope swings up to four times while the rows of the "
        "detectors are read. Amplitude: rms of the pointing along each axis.",
        stands_for="errors of the attitude control (paper, section Discussion); Gaia's "
        "micro-clanks",
        reference="Lindegren et al. 2016, A&A 595, A4",
        stage=DefectStage.FOCAL_PLANE,
        apply=optics.pointing_jitter,
        high=1e5,
    ),
    Defect(
        name="detector-shift",
        label="detector that moves in mid-orbit",
        unit="um",
        example="0.1um",
        does="One detector of each orbit shifts in a random direction, between a quarter and three "
        "quarters of the exposures. Amplitude: the shift on the focal plane.",
        stands_for="thermal motion of the focal plane; the motion of the chips of HST's WFPC2",
        reference="Anderson & King 2003, PASP 115, 113",
        stage=DefectStage.DETECTOR,
        apply=detectors.detector_shift,
        high=1e3,
    ),
    Defect(
        name="detector-turn",
        label="detector that turns in mid-orbit",
        unit="arcsec",
        example="2arcsec",
        does="One detector of each orbit turns about its centre, between a quarter and three "
        "quarters of the exposures. Amplitude: the angle, in the sense of the model's rotation.",
        stands_for="thermal motion of the focal plane; Gaia's geometric calibration in time",
        reference="Lindegren et al. 2012, A&A 538, A78",
        stage=DefectStage.DETECTOR,
        apply=detectors.detector_turn,
        low=-1e4,
        high=1e4,
    ),
    Defect(
        name="charge-transfer",
        label="shift along the columns that depends on magnitude",
        unit="mpix",
        example="5mpix",
        does="Stars shift along y of their detector, in proportion to the rows that their charge "
        "crosses and to flux^-1/2. Amplitude: shift of a star of magnitude 17 at the far end.",
        stands_for="charge that traps hold back, in HST's ACS and in Gaia",
        reference="Anderson & Bedin 2010, PASP 122, 1035; Short et al. 2013, MNRAS 430, 3078",
        stage=DefectStage.DETECTOR,
        apply=detectors.charge_transfer,
        low=-1e3,
        high=1e3,
        needs_magnitudes=True,
    ),
    Defect(
        name="pixel-phase",
        label="shift that depends on the position within the pixel",
        unit="mpix",
        example="3mpix",
        does="Stars shift along x and y by a sine of their position within the pixel, zero at its "
        "edges. Amplitude: that of the sine.",
        stands_for="an imperfect model of an undersampled image, as in HST, Euclid and JASMINE",
        reference="Anderson & King 2000, PASP 112, 1360",
        stage=DefectStage.DETECTOR,
        apply=detectors.pixel_phase,
        low=-1e3,
        high=1e3,
    ),
    Defect(
        name="noise",
        label="noise that is not as stated",
        unit="%",
        example="10%",
        does="The noise of all measurements is larger than their stated uncertainties, or smaller "
        "where the amplitude is negative. Amplitude: noise over uncertainty, less one.",
        stands_for="a wrong gain or read-out noise; the excess noise of Gaia's sources",
        reference="Lindegren et al. 2012, A&A 538, A78",
        stage=DefectStage.NOISE,
        apply=noise.noise,
        low=-99.0,
        high=1e4,
    ),
    Defect(
        name="noise-exposure",
        label="noise that differs between exposures",
        unit="%",
        example="20%",
        does="The noise is multiplied by a factor of each exposure, whose logarithm is normal with "
        "mean zero; the stated uncertainties are not. Amplitude: standard deviation of "
        "the logarithm.",
        stands_for="jitter during the exposure (paper, section Discussion); Gaia's excess "
        "attitude noise",
        reference="Lindegren et al. 2012, A&A 538, A78",
        stage=DefectStage.NOISE,
        apply=noise.noise_of_exposures,
        high=300.0,
    ),
    Defect(
        name="noise-magnitude",
        label="noise that depends on magnitude otherwise than stated",
        unit="%",
        example="20%",
        does="The noise over the stated uncertainty grows linearly with magnitude: one in the "
        "middle of the range, 13.75. Amplitude: its excess over one at the faint end, 19.5.",
        stands_for="a wrong error model, as found for Gaia's bright and faint stars",
        reference="Fabricius et al. 2021, A&A 649, A5",
        stage=DefectStage.NOISE,
        apply=noise.noise_of_magnitudes,
        low=-99.0,
        high=99.0,
        needs_magnitudes=True,
    ),
)
