"""The table of defects; a defect is one entry in a part of it, one function, and its test.

Defects of one stage are applied in the order of the table.
"""

from solver.simulate.defects.data_table import DATA_DEFECTS
from solver.simulate.defects.instrument_table import INSTRUMENT_DEFECTS

DEFECTS = (*INSTRUMENT_DEFECTS, *DATA_DEFECTS)
BY_NAME = {defect.name: defect for defect in DEFECTS}
