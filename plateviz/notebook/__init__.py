"""plateviz in a notebook or in any Python: the objects of `plateviz.open` and `plateviz.simulate`.

| file               | contents                                                          |
|--------------------|-------------------------------------------------------------------|
| opening.py         | `open` and `simulate`                                             |
| survey.py          | a survey: its orbits, its runs, its sources                       |
| orbit.py           | an orbit: its measurements, fits and what-ifs                     |
| solution.py        | a solution: its tables, its figures, its report                   |
| source.py          | a source through the orbits of a run                              |
| keywords.py        | the settings of a fit as keywords                                 |
| lazy_solver.py     | the solver process of an origin, started on first use             |
| progress.py        | a line of progress in a cell or in a terminal                     |
| lazy_collection.py | figures or tables by name, made on access                         |
| table.py           | tables with units                                                 |
| figures.py         | figures that display themselves                                   |
| card.py            | the verdict and the numbers of an object as HTML                  |
| report.py          | reports of an object                                              |
| dashboard.py       | the dashboard in a cell                                           |

Imports `plateviz.dashboard` and below. This process never imports JAX: fits run in the solver
process. Panel and Bokeh are imported when the first figure is drawn.
"""
