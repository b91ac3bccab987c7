"""Tests of a whole run, on tables of its orbits; imports what the tests of an orbit import."""
