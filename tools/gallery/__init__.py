"""The pictures of the gallery; see make_gallery.py."""
