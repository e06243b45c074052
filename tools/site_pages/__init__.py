"""The pages of `make site`: documents, modules of the program, perigeo-post; see make_site.py."""
