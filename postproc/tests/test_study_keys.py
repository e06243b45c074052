"""Keys of study files: where they stand, and which options figures have."""

from __future__ import annotations

from perigeo_post.study.figures import FIGURE_OPTIONS
from perigeo_post.study.tables import OPTIONS
from perigeo_post.study.toml import key_lines


def test_lines_of_keys_are_found_in_tables_and_lists_of_tables() -> None:
    text = """\
a = 1
[b]
"c.d" = 2
[[e]]
f = 3
[e.g]
h = 4
[[e]]
f = 5
[[e.i]]
j.k = 6
"""
    assert key_lines(text) == {
        ("a",): 1, ("b",): 2, ("b", "c.d"): 3, ("e", 0): 4, ("e", 0, "f"): 5, ("e", 0, "g"): 6,
        ("e", 0, "g", "h"): 7, ("e", 1): 8, ("e", 1, "f"): 9, ("e", 1, "i", 0): 10,
        ("e", 1, "i", 0, "j", "k"): 11,
    }  # fmt: skip


def test_every_option_of_a_figure_has_a_form() -> None:
    assert set().union(*FIGURE_OPTIONS.values()) == set(OPTIONS)
