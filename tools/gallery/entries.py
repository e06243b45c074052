"""What the gallery shows: runs, and pictures with the commands that draw them."""

from __future__ import annotations

from dataclasses import dataclass

POST = ".venv/bin/perigeo-post"

# Folder of results/gallery: input, settings. Each is one run, or one study.
RUNS = {
    "compression": ("input/compression.nml", ()),
    "controlled": ("input/compression.nml", ("stabilisation.method=relaxing",)),
    "heterogeneous": ("input/heterogeneous.nml", ()),
    "strip_footing": ("input/limit_loads/strip_footing.nml", ("stabilisation.method=relaxing",)),
}
STUDY = "tools/gallery/horizons.toml"


@dataclass(frozen=True)
class Entry:
    """A picture. `{run}` of a command is the result of a run, {study} the folder of the study."""

    picture: str
    words: str
    made_from: str
    command: str
    drawn: bool = True  # by `make gallery`; else by its own command, which is named


def post(run: str, words: str) -> str:
    return f"{POST} {words.replace('@', '{' + run + '}')}"


SECTIONS: dict[str, list[Entry]] = {
    "Curves: `perigeo-post curves`": [
        Entry("curves", "Stress against strain, with marks at chosen strains.", "compression",
              post("compression", "curves @ --mark 1% 1.3% 1.6%")),
        Entry("energies", "Where the work goes: stored, plastic, kinetic, damping.", "compression",
              post("compression", "curves @ --energies")),
        Entry("settlement", "Settlement of a strip footing against its load, as engineers draw "
              "it.", "strip_footing", post("strip_footing", "curves @ --settlement footing")),
        Entry("columns", "Any columns of the history against any other: forces on the footing and "
              "on the base.", "strip_footing",
              post("strip_footing", "curves @ --x time --y footing_force_y base_force_y")),
    ],
    "Fields: `perigeo-post contours`": [
        Entry("../compression", "Plastic strain at three states, on one colour scale.",
              "compression",
              f"{POST} contours results/compression/compression.h5 --strain 1% 1.3% 1.6%",
              drawn=False),
        Entry("yield_stress", "Soil whose strength varies from place to place.", "heterogeneous",
              post("heterogeneous", "contours @ --strain 0.35% --field yield_stress")),
        Entry("deformed", "The deformed body, five times enlarged, without zero-energy modes.",
              "controlled",
              post("controlled", "contours @ --strain 0.6% 1.6% --deformed 5 --smooth")),
        Entry("footing", "Plastic strain below a strip footing at its limit load.",
              "strip_footing", post("strip_footing", "contours @ --time 5 --deformed 2 --smooth")),
    ],
    "Bands: `perigeo-post band`": [
        Entry("band", "Width, angle and place of the shear bands, and the profile across the "
              "stronger one.", "compression", post("compression", "band @ --strain 1%")),
    ],
    "Runs side by side: `perigeo-post compare`": [
        Entry("compare", "The specimen without and with a control of zero-energy modes.",
              "compression", POST + " compare {compression} {controlled} --labels none relaxing "
              "--strain 1%"),
    ],
    "Films: `perigeo-post animate`": [
        Entry("animate", "One picture of a film: a GIF, or an MP4 where there is ffmpeg.",
              "compression", post("compression", "animate @")),
    ],
    "Bodies before they are run: `perigeo-post geometry`": [
        Entry("../geometry_cylinder", "Points, boundaries and loads of a thick cylinder.",
              "input/limit_loads/cylinder.nml",
              f"{POST} geometry input/limit_loads/cylinder.nml", drawn=False),
        Entry("slope_body", "A slope of 60 degrees.", "input/limit_loads/slope.nml",
              f"{POST} geometry input/limit_loads/slope.nml"),
    ],
    "Studies: `perigeo-post study`": [
        Entry("plot", "`plot`: a measure against a parameter.", STUDY, "{study}/plot.png"),
        Entry("study_curves", "`curves`: stress-strain curves of all runs.", STUDY,
              "{study}/study_curves.png"),
        Entry("contours", "`contours`: a field of all runs, on one colour scale.", STUDY,
              "{study}/contours.png"),
        Entry("profiles", "`profiles`: plastic strain across the bands.", STUDY,
              "{study}/profiles.png"),
        Entry("history", "`history`: a column of the histories.", STUDY, "{study}/history.png"),
        Entry("quality", "`quality`: how quasi-static the runs are.", STUDY,
              "{study}/quality.png"),
    ],
    "Limit loads: `make limit_loads`": [
        Entry(f"../limit_load_{name}", words, f"input/limit_loads/{name}.nml",
              f".venv/bin/python tests/verify/limits.py {case}", drawn=False)
        for name, case, words in (
            ("strip_footing", "footing", "Rough strip footing; lines: Prandtl's mechanism."),
            ("smooth_footing", "smooth_footing", "Smooth strip footing."),
            ("softening_footing", "softening_footing", "Strip footing on soil that softens."),
            ("growing_strength_smooth", "growing_strength_smooth",
             "Footing on clay whose strength grows with depth."),
            ("slope", "slope", "Slope of 60 degrees."),
            ("vertical_cut", "vertical_cut", "Vertical cut under its own weight."),
            ("excavation", "excavation", "Excavation in stages, at its collapse."),
            ("trapdoor", "trapdoor", "Trapdoor below clay."),
            ("cylinder", "cylinder", "Thick cylinder under pressure."),
        )
    ] + [
        Entry("../limit_load_cylinder_radius", "Radial displacement against pressure.",
              "input/limit_loads/cylinder.nml",
              ".venv/bin/python tests/verify/limits.py cylinder", drawn=False),
        Entry("../wall_rotation", "A wall that turns about its toe.",
              "input/limit_loads/wall_rotation.nml",
              f"{POST} contours results/wall_rotation/wall_rotation.h5 --frame 5 "
              "--field displacement_magnitude --deformed 3 --smooth", drawn=False),
    ],
    "Beside finite elements: `make finite_elements`": [
        Entry("../finite_elements", "Load against displacement, in both programs.",
              "tests/verify/finite_elements.py", "make finite_elements", drawn=False),
        Entry("../finite_elements_softening", "A specimen that softens: the work falls with the "
              "mesh, and settles with the spacing.",
              "tests/verify/finite_elements.py", "make finite_elements", drawn=False),
    ],
}  # fmt: skip
