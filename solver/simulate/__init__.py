"""The mini-mock survey of the paper's section "Experiment", for any number of orbits.

| file         | what                                                              |
|--------------|-------------------------------------------------------------------|
| settings.py  | every number of the survey, with its source                       |
| sky.py       | Galactic coordinates to ICRS and back                             |
| seasons.py   | the observation periods                                           |
| population.py| stars like those that Gaia sees towards the Galactic centre       |
| gaia.py      | stars of the Gaia archive                                         |
| catalogue.py | the true catalogue and the reference catalogue resampled from it  |
| schedule.py  | when and where each exposure is taken, and where it really pointed|
| placement.py | where the detectors really are                                    |
| measure.py   | the measurements of one orbit                                     |
| survey.py    | a survey directory                                                |

Imports `solver.problem` and below. Only `measure.py` and `survey.py` import JAX. Every optical
step is that of `solver.model.forward`.
"""
