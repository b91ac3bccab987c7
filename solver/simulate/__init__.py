"""The mini-mock survey of the paper's section "Experiment", for any number of orbits.

| file         | content                                                           |
|--------------|-------------------------------------------------------------------|
| settings.py  | all numbers of the survey, with their sources                     |
| streams.py   | independent streams of random numbers                             |
| sky.py       | Galactic coordinates to ICRS and back                             |
| seasons.py   | the observation periods                                           |
| population.py| synthetic stars towards the Galactic centre, as observed by Gaia  |
| magnitudes.py| magnitudes of the stars, and noise that depends on them           |
| gaia.py      | stars of the Gaia archive                                         |
| catalogue.py | the true catalogue and the reference catalogue resampled from it  |
| schedule.py  | schedule and true attitude of the exposures                       |
| placement.py | true positions of the detectors                                   |
| geometry.py  | the observation model's origins at the true values                |
| measure.py   | the measurements of one orbit                                     |
| defects      | the table of defects, and what each does                          |
| defective.py | the measurements of one orbit with defects                        |
| survey.py    | a survey directory                                                |

Imports `solver.problem` and below. Only `geometry.py`, `measure.py`, `defective.py` and `survey.py`
import JAX. The optical model is `solver.model.forward`.
"""
