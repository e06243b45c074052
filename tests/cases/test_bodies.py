"""Bodies of polygons, circles and holes: areas, both forms of the operators, contacts, messages."""

import json

import h5py
import numpy as np
import pytest
from case_files import history, uncontrolled
from frozen_cases import POLYGON
from perigeo_post.cli.command_line import main as perigeo_post

ROUND_OFF = 1e-9

HEAD = """\
&run name = 'case', output_dir = 'out' /
&discretisation spacing = 0.1, horizon = 0.3, volumes = 'tributary' /
&material model = 'j2', density = 2000.0, youngs_modulus = 50.0e6, poissons_ratio = 0.3
  yield_stress = 5.0e3 /
&integration end_time = 0.01, damping = 2.0e4 /
"""
SOLID = "&body name = 'ground', shape = 'polygon', vertices = 0, 0, 2, 0, 2, 1, 1, 1.5, 0, 1 /\n"
HOLE = "&body name = 'pit', shape = 'circle', x = 1, y = 0.6, radius = 0.3, role = 'hole' /\n"


@pytest.fixture
def fields(run_case, tmp_path):
    """Return a function that runs a case and returns its points, last frame and history."""

    def run(text, *options):
        done = run_case(text, tmp_path, "--quiet", "--force", "--threads", "1", *options)
        assert done.returncode == 0, done.stderr
        rows = history(tmp_path / "out" / "case_history.csv")
        with h5py.File(tmp_path / "out" / "case.h5", locking=False) as file:
            frame = file["frames"][list(file["frames"])[-1]]
            found = {name: data[()] for name, data in frame.items()}
            found |= {name: data[()] for name, data in file["points"].items()}
        return found, rows

    return run


def test_both_forms_agree_on_a_polygon_with_a_hole(fields):
    one, other = (fields(POLYGON, "--set", f"run.operators={form}") for form in ("lattice", "list"))
    assert one[0]["plastic_strain"].max() > 1e-4
    for name in ("displacement", "stress", "plastic_strain"):
        scale = np.abs(one[0][name]).max()
        assert np.abs(one[0][name] - other[0][name]).max() < ROUND_OFF * scale, name
    for name in ("footing_force_y", "wall_force_x", "rim_force_y", "strain_energy"):
        scale = np.abs(one[1][name]).max()
        assert np.abs(one[1][name] - other[1][name]).max() < ROUND_OFF * scale, name


def test_energies_balance_with_contacts_on_edges(fields):
    rows = fields(POLYGON)[1]
    assert np.abs(rows["energy_error"][10:]).max() < 1e-3
    # a sliding footing: no force along it, to the last bit
    assert not rows["footing_force_x"].any()
    assert rows["footing_force_y"][-1] < 0.0


def test_layers_of_a_smooth_edge_are_the_image_of_the_body(fields):
    found, rows = fields(POLYGON)
    layer = np.flatnonzero(found["boundary"] == 2)
    assert len(layer) > 20
    assert not found["plastic_strain"][layer].any()
    assert not found["stress"][layer].any()
    body = np.flatnonzero(found["boundary"] == 0)
    far = (found["position"][layer, 1] - found["position"][layer, 1].min()) / 0.1
    first = found["position"][body, 1][
        np.abs(found["position"][body, 1] - found["position"][layer, 1].min()) < 0.15
    ].max()
    for i, k in zip(layer, np.rint(far)):
        x, _ = found["position"][i]
        there = np.abs(found["position"][body] - [x, first - 0.1 * k]).max(axis=1) < 1e-6
        assert there.sum() == 1
        origin = body[there][0]
        assert found["displacement"][i, 0] == found["displacement"][origin, 0]
        assert found["displacement"][i, 1] + found["displacement"][origin, 1] == pytest.approx(
            2.0 * rows["footing_displacement_y"][-1]
        )


FOOTING = """\
&run name = 'case', output_dir = 'out' /
&discretisation spacing = 0.1, horizon = 0.3, layout = 'cells' /
&body x_min = -2.0, x_max = 2.0, y_min = -1.5, y_max = 0.0 /
&material model = 'j2', strain_measure = 'small', density = 2000.0, youngs_modulus = 10.0e6
  poissons_ratio = 0.3, yield_stress = 17320.508 /
&boundary name = 'base', side = 'bottom' /
&boundary name = 'left', side = 'left', contact = 'smooth' /
&boundary name = 'right', side = 'right', contact = 'smooth' /
&boundary name = 'footing', side = 'top', span = -0.5, 0.5, contact = 'smooth'
  velocity = 0.0, -0.01 /
&integration method = 'equilibrium', end_time = 3.0, increments = 10, residual = 1.0e-3 /
&output history_count = 10, frame_count = 1 /
"""


def test_a_polygon_of_four_corners_is_the_rectangle(fields):
    text = uncontrolled(FOOTING)
    corners = "shape = 'polygon', vertices = -2, -1.5, 2, -1.5, 2, 0, -2, 0"
    rectangle = "x_min = -2.0, x_max = 2.0, y_min = -1.5, y_max = 0.0"
    one, other = fields(text), fields(text.replace(rectangle, corners))
    for name in ("position", "volume", "displacement", "stress"):
        assert one[0][name].tobytes() == other[0][name].tobytes(), name


def polygon(vertices, keys=""):
    """Return a body of these vertices."""
    return f"&body name = 'odd', shape = 'polygon', vertices = {vertices}{keys} /\n"


EDGE = "&boundary name = 'b', body = 'ground', "
# text of the bodies and boundaries, exit status, and what the message must hold
MISTAKES = {
    "crossing": (
        polygon("0, 0, 1, 1, 1, 0, 0, 2"), 2,
        "&body vertices, 'odd': the polygon crosses or touches itself; found: edges 1 and 3"),
    "odd number": (polygon("0, 0, 1, 1, 1"), 2, "a vertex without its y; found: 5 numbers"),
    "two vertices": (polygon("0, 0, 1, 1"), 2, "too few vertices; found: 2; allowed: three"),
    "repeated": (polygon("0, 0, 1, 0, 1, 1, 0, 0"), 2,
                 "two vertices coincide; found: vertices 1 and 4: 0.0, 0.0"),
    "no area": (polygon("0, 0, 1, 1, 2, 2"), 2, "the polygon has no area"),
    "no vertices": ("&body shape = 'polygon' /\n", 2, "vertices: the key is missing"),
    "vertices of a rectangle": (
        "&body x_min = 0, x_max = 1, y_min = 0, y_max = 1, vertices = 0, 0 /\n", 2,
        "vertices: the key has no effect on shape = 'rectangle'"),
    "extents of a polygon": (polygon("0, 0, 1, 0, 1, 1", ", x_min = 0"), 2,
                             "x_min: the key has no effect on shape = 'polygon'"),
    "circle without radius": ("&body shape = 'circle', x = 1, y = 1 /\n", 2,
                              "radius: the key is missing, it is needed for a circle"),
    "hole first": (HOLE + SOLID, 2, "role: the first body is a hole"),
    "material of a hole": (SOLID + HOLE.replace("role", "material = 'material', role"), 2,
                           "material: the key has no effect on a hole"),
    "same names": (SOLID + SOLID, 2, "two bodies have the same name; found: 'ground'"),
    "fit": (SOLID + "&discretisation /\n", 2, "the group is given twice"),
    "unknown body": (SOLID + "&boundary name = 'b', body = 'grund' /\n", 2,
                     "unknown body, did you mean 'ground'?; found: 'grund'"),
    "nameless body": (
        SOLID.replace("name = 'ground', ", "") + "&boundary name = 'b', body = 'a' /\n", 2,
        "no body has a name"),
    "unknown material": (SOLID.replace("shape", "material = 'sand', shape"), 2,
                         "unknown material; found: 'sand'"),
    "edge too high": (SOLID + EDGE + "edge = 6 /\n", 2,
                      "the body 'ground' has no such edge; found: 6; allowed: 1 to 5"),
    "edge of a circle": (SOLID + HOLE + "&boundary name = 'b', body = 'pit', edge = 1 /\n", 2,
                         "a circle has no edges"),
    "edge without body": (SOLID + "&boundary name = 'b', side = 'top', edge = 1 /\n", 2,
                          "edge: the key has no effect without body"),
    "side and body": (SOLID + EDGE + "side = 'top' /\n", 2, "a boundary on a side and on a body"),
    "span on a body": (SOLID + EDGE + "span = 0, 1 /\n", 2, "a span on a body"),
    "traction on a body": (SOLID + EDGE + "traction = 0, 1 /\n", 2, "a traction on edges of a"),
    "smooth and inclined": (SOLID + EDGE + "edge = 3, contact = 'smooth' /\n", 2,
                            "a smooth boundary on an inclined edge; found: edge 3 of 'ground'"),
    "smooth all round": (SOLID + EDGE + "contact = 'smooth' /\n", 2,
                         "a smooth boundary all round a body"),
    "pressure on an edge": (
        SOLID + EDGE + "edge = 1 /\n&pressure name = 'p', side = 'bottom', value = 1 /\n", 2,
        "a pressure on a side with a boundary; found: 'bottom', where 'b' lies"),
    "edge twice": (SOLID + EDGE + "edge = 1 /\n" + EDGE.replace("'b'", "'c'") + "edge = 1 /\n", 2,
                   "two boundaries lie on the same edge; found: 'ground', where 'b' lies"),
    "body of no point": (SOLID + polygon("0.02, 0.02, 0.06, 0.02, 0.02, 0.06"), 3,
                         "&body number 2, 'odd': a body leaves no point"),
    "covered body": (SOLID + SOLID.replace("ground", "again"), 3,
                     "&body number 1, 'ground': a body leaves no point"),
    "hole outside": (SOLID + HOLE.replace("x = 1", "x = 4"), 3,
                     "&body number 2, 'pit': a hole takes nothing away"),
    "boundary on nothing": (
        SOLID + "&body x_min = 2, x_max = 3, y_min = 0, y_max = 1 /\n" + EDGE + "edge = 2 /\n", 3,
        "&boundary number 1, &body number 1, 'ground', edge 2: a boundary holds no point"),
    "patch on nothing": (
        SOLID + "&imperfection amplitude = 0.1, x = 0.05, y = 0.05, radius = 0.01 /\n", 3,
        "&imperfection: the weak patch holds no point of the body"),
    "patch in a hole": (
        SOLID + HOLE + "&imperfection amplitude = 0.1, x = 1, y = 0.6, radius = 0.1 /\n", 3,
        "&imperfection: the weak patch holds no point of the body"),
}  # fmt: skip


@pytest.mark.parametrize("mistake", MISTAKES)
def test_wrong_geometry_is_named_with_its_place(run_case, tmp_path, mistake):
    bodies, status, part = MISTAKES[mistake]
    done = run_case(HEAD + bodies, tmp_path)
    assert done.returncode == status, done.stderr
    assert part in done.stderr
    assert not (tmp_path / "out").exists()


def test_a_needle_is_looked_at_at_once(perigeo, tmp_path):
    """What lies between lattice lines is given to points that are thousands of cells away."""
    needle = polygon("0, 0, 2, 0, 2, 1, 1.07, 1, 1.04, 1500, 1.03, 1, 0, 1")
    (tmp_path / "run.nml").write_text(HEAD + needle)
    done = perigeo(["--check", "run.nml"], tmp_path, timeout=30.0)
    assert done.returncode == 0, done.stderr
    assert "points" in done.stdout


def test_a_field_that_touches_no_point_is_refused(run_case, tmp_path):
    soft = "&material name = 'soft', model = 'elastic', density = 1, youngs_modulus = 1e6,"
    text = HEAD.replace("&material", "&material name = 'clay'") + soft + " poissons_ratio = 0.3 /\n"
    text += SOLID.replace("shape", "material = 'soft', shape")
    field = "&random_field coefficient_of_variation = 0.1, correlation_length = 0.5, seed = 1 /\n"
    done = run_case(text + field, tmp_path)
    assert done.returncode == 3
    assert "&random_field: the random field touches no point that can yield" in done.stderr


def test_the_points_of_an_input_are_shown_before_it_is_run(program, tmp_path, capsys):
    path = tmp_path / "run.nml"
    path.write_text(uncontrolled(
        HEAD + SOLID + HOLE + "&boundary name = 'rim', body = 'pit' /\n"
        "&boundary name = 'base', side = 'bottom' /\n"
        "&pressure name = 'wall', side = 'left', value = 1e3 /\n"
        "&imperfection amplitude = 0.1, x = 1.7, y = 0.5, radius = 0.2 /\n"
    ))  # fmt: skip
    figure = tmp_path / "body.png"
    command = ["geometry", str(path), "--program", str(program), "-o", str(figure), "--json"]
    assert perigeo_post(command) == 0
    numbers = json.loads(capsys.readouterr().out)
    assert figure.stat().st_size > 10000
    assert set(numbers["boundaries"]) == {"rim", "base"}
    assert numbers["loads"]["wall"] == pytest.approx([1e3 * 1.0, 0.0], rel=0.06, abs=1e-6)
    # without layers the volumes are the area of the body
    assert perigeo_post([*command, "--set", "boundary="]) == 0
    numbers = json.loads(capsys.readouterr().out)
    area = 2.5 - np.pi * 0.3**2
    assert numbers["materials"]["material"]["area"] == pytest.approx(area, rel=1e-9)
    assert perigeo_post([*command, "--set", "body.ground.vertices=0,0,1,1"]) == 1
    assert "too few vertices" in capsys.readouterr().err


def test_points_need_check(perigeo, tmp_path):
    done = perigeo(["--points", "p.txt", "run.nml"], tmp_path)
    assert done.returncode == 1
    assert "--points goes with --check" in done.stderr


def test_a_pressure_acts_beside_bearings_on_the_body_alone(run_case, tmp_path):
    """A wall of soil continues the body and is pressed too; a bearing is no part of it."""
    text = HEAD + "&body name = 'b', x_min = 0, x_max = 2, y_min = 0, y_max = 2 /\n"
    text += "&pressure name = 'p', side = 'top', value = 1e3 /\n&boundary name = 'w', "
    soil = run_case(text + "side = 'left', contact = 'smooth' /\n", tmp_path, "--check").stdout
    bearing = run_case(
        text + "body = 'b', edge = 4, contact = 'smooth' /\n", tmp_path, "--check"
    ).stdout
    assert "2 m of the body and layers that continue it" in soil
    assert "2350 N/m in all" in soil
    assert "2 m of the body, " in bearing
    assert "2000 N/m in all" in bearing
