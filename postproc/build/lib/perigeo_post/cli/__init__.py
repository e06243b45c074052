"""The command line ``perigeo-post``."""
