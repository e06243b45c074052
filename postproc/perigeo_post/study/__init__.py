"""Carry out a study: plan its runs, make them, measure and draw."""
