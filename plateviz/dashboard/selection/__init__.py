"""The selection of a session: sources, exposures and detectors, and its part of an address."""
