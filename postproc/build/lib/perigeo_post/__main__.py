"""``python -m perigeo_post`` does what ``perigeo-post`` does."""

from .cli.command_line import main_entry

if __name__ == "__main__":
    main_entry()
