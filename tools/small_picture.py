"""Make a picture small enough for a page:  small_picture.py FROM.png TO.png

At most 1000 pixels wide, 64 colours. perigeo-post draws with more, for print.
"""

import sys

from PIL import Image

WIDEST = 1000  # pixels
COLOURS = 64

if len(sys.argv) != 3:
    sys.exit(__doc__)
picture = Image.open(sys.argv[1]).convert("RGB")
picture.thumbnail((WIDEST, picture.height))
few = picture.quantize(COLOURS, Image.Quantize.MAXCOVERAGE, 3, dither=Image.Dither.NONE)
few.save(sys.argv[2], optimize=True)
