"""The version of perigeo-post."""

__version__ = "0.1.0"
