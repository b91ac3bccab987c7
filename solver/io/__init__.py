"""Files: the published FITS layout and the same tables as ECSV, CSV, Parquet and VOTable.

Everything that reads or writes a file of an orbit is here, and nothing here imports JAX:
the web process reads results without starting it. A file is judged before it is used,
and whatever is wrong with it ends in one `solver.errors.InputError`.
"""
