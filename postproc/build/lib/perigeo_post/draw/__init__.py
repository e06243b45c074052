"""Draw what was measured: figures, contours, animations, and the style of all of them."""

from ..surroundings import import_matplotlib

import_matplotlib()
