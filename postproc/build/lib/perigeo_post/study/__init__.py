"""Carry out a study: plan its runs, make them, measure and draw."""

from ..surroundings import import_matplotlib

import_matplotlib()
