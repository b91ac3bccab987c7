"""Defects of the data: measurements, observer, reference catalogue and times."""

from solver.simulate.defects import catalogue, measurements, observer
from solver.simulate.defects.defect import Defect, DefectStage

DATA_DEFECTS = (
    Defect(
        name="outliers",
        label="outliers",
        unit="%",
        example="1%",
        does="Measurements get an error of 5 to 50 sigma (log-uniform) in a random direction. "
        "Amplitude: their share.",
        stands_for="cosmic rays, defective pixels, neighbours within the image",
        reference="Lindegren et al. 2012, A&A 538, A78 (treatment of outliers in Gaia)",
        stage=DefectStage.MEASUREMENTS,
        apply=measurements.outliers,
        high=90.0,
    ),
    Defect(
        name="swapped",
        label="swapped identifications",
        unit="%",
        example="0.2%",
        does="Measurements have the ids of their nearest neighbours on the detector, in pairs. "
        "Amplitude: the share of measurements with a wrong id.",
        stands_for="errors of the cross-match, in crowded fields as of Gaia",
        reference="Torra et al. 2021, A&A 649, A10",
        stage=DefectStage.MEASUREMENTS,
        apply=measurements.swapped,
        high=90.0,
    ),
    Defect(
        name="missing",
        label="missing identifications",
        unit="%",
        example="5%",
        does="Measurements are not identified, so that the table lacks them. Amplitude: their "
        "share. The solution has fewer data and is not wrong.",
        stands_for="incompleteness of detection and cross-match",
        reference="Torra et al. 2021, A&A 649, A10",
        stage=DefectStage.MEASUREMENTS,
        apply=measurements.missing,
        high=90.0,
    ),
    Defect(
        name="satellite-velocity",
        label="satellite velocity left out",
        unit="km/s",
        example="7.6km/s",
        does="The satellite moves about the Earth in a dawn-to-dusk orbit of 97 min, at a random "
        "phase, and the table of exposures has the velocity zero. Amplitude: its speed.",
        stands_for="aberration by JASMINE's orbital motion (paper, section Discussion)",
        reference="Klioner 2003, AJ 125, 1580",
        stage=DefectStage.OBSERVER,
        apply=observer.satellite_velocity,
        high=100.0,
    ),
    Defect(
        name="reference-errors",
        label="reference errors understated",
        unit="%",
        example="30%",
        does="The errors of the reference stars' five parameters are larger than their stated "
        "uncertainties allow. Amplitude: actual over stated error, less one.",
        stands_for="Gaia's formal uncertainties, which are too small by 5 to 30 %",
        reference="Fabricius et al. 2021, A&A 649, A5",
        stage=DefectStage.CATALOGUE,
        apply=catalogue.reference_errors,
        low=-100.0,
        high=1e4,
    ),
    Defect(
        name="binaries",
        label="wrong reference stars",
        unit="",
        example="5",
        does="Reference stars around the target have a proper motion that is wrong by 0.5 mas/yr, "
        "6.5 mas at 13 yr, in random directions. Amplitude: their number.",
        stands_for="binaries whose photocentre moved during Gaia's observations",
        reference="Kervella et al. 2019, A&A 623, A72; Halbwachs et al. 2023, A&A 674, A9",
        stage=DefectStage.CATALOGUE,
        apply=catalogue.binaries,
        low=1.0,
        high=1e4,
        is_count=True,
    ),
    Defect(
        name="zonal-errors",
        label="smooth zonal errors of the catalogue",
        unit="mas",
        example="1mas",
        does="The catalogue's positions are displaced by a smooth random field with wavelengths of "
        "1.5 to 3 deg. Amplitude: its rms at the reference stars, along each axis.",
        stands_for="errors of Gaia that neighbouring stars share",
        reference="Lindegren et al. 2021, A&A 649, A2; Vasiliev & Baumgardt 2021, MNRAS 505, 5978",
        stage=DefectStage.CATALOGUE,
        apply=catalogue.zonal_errors,
        high=1e3,
    ),
    Defect(
        name="exposure-times",
        label="wrong times of exposures",
        unit="s",
        example="1h",
        does="The table of exposures has times that are too late, all by the amplitude.",
        stands_for="an error of the clock or of the time scale, or another epoch of the catalogue; "
        "the same sources, and the Earth's velocity, at another time",
        reference="Klioner 2003, AJ 125, 1580",
        stage=DefectStage.EXPOSURES,
        apply=observer.exposure_times,
        low=-1e8,
        high=1e8,
    ),
)
