"""Numbers and limits beyond all sense: a sentence, never a trap, a hang or a crash."""

import re
import resource
import subprocess

import h5py
import pytest
from case_files import SPECIMEN, changed, without_group

KILOBYTE = 1024
HOLE = "&body name = 'bore', role = 'hole', shape = 'circle', x = 0.2, y = 0.5, radius = 0.1 /\n"


@pytest.mark.parametrize("hole", [{"y": "4294967296.0"}, {"radius": "1.0e99"}, {"x": "-1.0e99"}])
def test_a_hole_beyond_counting_is_refused(run_case, tmp_path, hole):
    done = run_case(SPECIMEN + changed(HOLE, **hole), tmp_path, "--check")
    assert done.returncode == 2
    assert "the hole reaches too far away from the solid bodies" in done.stderr


def test_a_circle_of_which_all_is_missing_is_told(run_case, tmp_path):
    text = SPECIMEN + "&body name = 'bore', shape = 'circle' /\n"
    done = run_case(text, tmp_path, "--check")
    assert done.returncode == 2
    assert "&body radius: the key is missing" in done.stderr


LAYOUT = "&discretisation layout = 'cells', volumes = 'tributary',"
NEEDLE = "&body shape = 'polygon', vertices = 0, 0, 2, 0, 2, 1, 1500, 1.3, 2, 1.5, 2, 2, 0, 2 /"


def test_a_needle_of_a_body_is_told(run_case, tmp_path):
    """Thousands of slivers far from any point look for the nearest one."""
    text = changed(without_group(SPECIMEN, "imperfection"), spacing="0.25", horizon="0.75").replace(
        "&discretisation", LAYOUT
    )
    text = text.replace("&body x_min = 0.0, x_max = 0.5, y_min = 0.0, y_max = 1.0 /", NEEDLE)
    done = run_case(text, tmp_path, "--check")
    assert done.returncode == 3
    assert "the shape tensor is singular" in done.stderr


def test_large_numbers_are_told_with_their_exponent(run_case, tmp_path):
    text = changed(SPECIMEN, frame_strains=None).replace("final_strain = 0.01", "end_time = 1.0e99")
    done = run_case(text, tmp_path, "--check")
    assert done.returncode == 2
    assert "too many steps; found: 9." in done.stderr
    assert "E+101; allowed" in done.stderr


def with_stack(kilobytes):
    limit = kilobytes * KILOBYTE
    return lambda: resource.setrlimit(resource.RLIMIT_STACK, (limit, limit))


@pytest.mark.parametrize("threads", ["1", "2"])
def test_a_small_stack_is_enough_or_is_told(program, tmp_path, threads):
    (tmp_path / "run.nml").write_text(SPECIMEN)
    for kilobytes, status in ((64, 3), (255, 3), (256, 0)):
        done = subprocess.run(
            [program, "--threads", threads, "run.nml"], cwd=tmp_path, check=False,
            capture_output=True, text=True, preexec_fn=with_stack(kilobytes),
        )  # fmt: skip
        assert done.returncode == status, (kilobytes, done.stderr)
        told = f"the limit of the stack (ulimit -s) is too small for any run; found: {kilobytes} kB"
        assert (told in done.stderr) == (status == 3)


OF_STRESS = ("density", "youngs_modulus", "yield_stress", "kinematic_modulus", "isotropic_modulus",
             "residual_strength", "damping")  # fmt: skip
FAR = changed(SPECIMEN, final_strain="0.1", frame_strains="0.02, 0.1")
UNITS = {
    "softening": FAR + "&stabilisation method = 'relaxing' /\n",
    "both moduli": changed(FAR, kinematic_modulus="-1.5e6, isotropic_modulus = -1.0e6"),
    "at rest": re.sub(r"damping = [^/]*", "method = 'equilibrium', increments = 40 ", FAR),
}


def in_unit(text, unit):
    """Return an input with all stresses, and the density and damping, a factor larger."""

    def factor(match):
        return f"{match[1]} = {float(match[2]) * unit!r}"

    return re.sub(rf"\b({'|'.join(OF_STRESS)}) = ([-+.\deE]+)", factor, text)


def numbers_of(path):
    """Return all numbers of a result with whether their unit is one of stress."""
    with h5py.File(path) as file:
        rows = {name: data[()] for name, data in file["history"].items()}
        units = {name: data.attrs["unit"] for name, data in file["history"].items()}
        for name, data in file["frames/000002"].items():
            rows[f"frame {name}"] = data[()]
            units[f"frame {name}"] = data.attrs["unit"]
    return {name: (data, units[name] in (b"Pa", b"N/m", b"J/m")) for name, data in rows.items()}


@pytest.mark.parametrize("case", UNITS)
def test_the_unit_of_stress_changes_no_bit(run_case, tmp_path, case):
    """Powers of two have no round-off of their own: 2e-87, 1e-20, 7e19 and 2e87."""
    assert run_case(UNITS[case], tmp_path, "--quiet").returncode == 0
    wanted = numbers_of(tmp_path / "out" / "case.h5")
    assert wanted["max_plastic_strain"][0][-1] > 0.1
    for exponent in (-288, -66, 66, 290):
        unit = 2.0**exponent
        done = run_case(in_unit(UNITS[case], unit), tmp_path, "--quiet", "--force")
        assert done.returncode == 0, done.stderr
        for name, (found, scaled) in numbers_of(tmp_path / "out" / "case.h5").items():
            expected = wanted[name][0] * unit if scaled else wanted[name][0]
            assert (expected == found).all(), (exponent, name)
