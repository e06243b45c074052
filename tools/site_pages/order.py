"""What the site holds, and in which order its navigation shows it.

Documents that are named nowhere here are found all the same: they come last in their group, a
tutorial or notebook among the tutorials, all others under "More".
"""

from __future__ import annotations

from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]

# Group of the navigation: documents in their order. Those that do not exist are passed over.
GROUPS = {
    "Start": [
        "README.md",
        "doc/install.md",
        "doc/first_footing.md",
        "doc/gallery.md",
        "doc/coming_from.md",
    ],
    "Tutorials": [
        "doc/tutorials/README.md",
        "doc/tutorials/specimen.md",
        "doc/tutorials/biaxial.md",
        "doc/tutorials/cyclic_shear.md",
        "doc/tutorials/hole.md",
        "doc/tutorials/footing.md",
        "doc/tutorials/slope.md",
        "doc/tutorials/wall.md",
        "doc/tutorials/excavation.md",
        "doc/tutorials/cloud.md",
        "doc/tutorials/study.md",
        "doc/tutorials/figure.md",
        "doc/tutorials/figure.ipynb",
    ],
    "Choose and judge": [
        "doc/own_test.md",
        "doc/limits.md",
        "doc/model.md",
        "doc/choices.md",
        "doc/doubts.md",
    ],
    "Reference": [
        "doc/input.md",
        "doc/results.md",
        "doc/measures.md",
        "doc/studies.md",
        "postproc/README.md",
        "doc/parallel.md",
        "doc/reliability.md",
        "doc/performance.md",
    ],
    "Theory and proof": [
        "doc/theory.md",
        "doc/verification.md",
        "doc/verification_table.md",
        "doc/study_tables.md",
    ],
    "Develop": [
        "doc/design.md",
        "doc/material_law.md",
        "CONTRIBUTING.md",
        "CHANGELOG.md",
    ],
}
TUTORIALS = "Tutorials"
MORE = "More"
FOUND = ("*.md", "doc/*.md", "doc/tutorials/*.md", "doc/**/*.ipynb", "postproc/README.md")


def documents(root: Path = ROOT) -> dict[str, list[str]]:
    """Return the documents of each group, as paths from the root."""
    found = sorted({path for pattern in FOUND for path in root.glob(pattern)})
    names = [
        path.relative_to(root).as_posix()
        for path in found
        if ".ipynb_checkpoints" not in path.parts
    ]
    listed = {name for group in GROUPS.values() for name in group}
    groups = {group: [n for n in order if n in names] for group, order in GROUPS.items()}
    for name in names:
        if name not in listed:
            own = name.startswith("doc/tutorials/") or name.endswith(".ipynb")
            groups.setdefault(TUTORIALS if own else MORE, []).append(name)
    return {group: order for group, order in groups.items() if order}
