"""plateviz in a notebook, or in any Python: what `plateviz.open` and `plateviz.simulate` give.

| file         | what                                                                    |
|--------------|-------------------------------------------------------------------------|
| opening.py   | what a person gives, and the object that it opens                       |
| survey.py    | a survey: its orbits, its runs, its sources                             |
| orbit.py     | an orbit: fitted, and asked what if                                     |
| solution.py  | a solution: its tables, its figures, its report                         |
| source.py    | a source through the orbits of a run                                    |
| choices.py   | the choices of a fit, as keywords                                       |
| lazy_solver.py     | the solver process of a source, started when it is first needed         |
| progress.py  | a line of progress in a cell, or in a terminal                          |
| named.py     | figures or tables by their names, for those who press Tab               |
| table.py     | tables with units                                                       |
| drawing.py   | figures that display themselves                                         |
| card.py      | the verdict and the numbers of an object as HTML                        |
| dashboard.py | the dashboard in a cell                                                 |

Imports `plateviz.dashboard` and below. This process never imports JAX: fits run in the solver
process. Panel and HoloViews are imported when the first figure is drawn.
"""
