"""The figure of any column of a table against any other."""
