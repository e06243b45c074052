"""Measure what a result holds: curves, moduli, shear bands, quality."""
