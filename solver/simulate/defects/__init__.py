"""Defects that a simulated survey may have, each with its physics, unit and literature.

| file            | content                                                                 |
|-----------------|-------------------------------------------------------------------------|
| table.py        | the table of defects: `instrument_table.py` and `data_table.py`         |
| defect.py       | an entry of the table, and what its function gets                       |
| text.py         | a defect as text, NAME=AMPLITUDE                                        |
| optics.py       | displacements on the focal plane                                        |
| detectors.py    | displacements on the detectors                                          |
| noise.py        | noise that differs from the stated uncertainties                        |
| measurements.py | wrong rows of the table of measurements                                 |
| observer.py     | the satellite's velocity, and the recorded times                        |
| catalogue.py    | errors of the reference catalogue                                       |
| stages.py       | the defects of a survey, applied stage by stage                         |

Imports `solver.model` and below without JAX, and of `solver.simulate` what knows no settings.
"""
