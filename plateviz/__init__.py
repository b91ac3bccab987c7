"""plateviz: run Plate Analysis on an orbit, and see whether to trust the solution."""
