"""perigeo-post advise: its inputs raise no doubt at any size, and have the strength asked for."""

import itertools

import pytest
from case_files import history
from perigeo_post.cli.command_line import main


@pytest.fixture
def advise(capsys):
    """Return a function that returns the input for some options."""

    def ask(*options):
        assert main(["advise", *map(str, options)]) == 0
        return capsys.readouterr().out

    return ask


SIZES = [(0.05, 0.1), (1.0, 2.03), (50.0, 20.0)]
STRENGTHS = [1e3, 50e3, 1e6]


@pytest.mark.parametrize(("size", "c_u"), [*itertools.product(SIZES, STRENGTHS)])
def test_no_doubt_at_any_size_and_strength(advise, perigeo, tmp_path, size, c_u):
    soil = ["--cu", c_u, "--size", *size]
    texts = {
        "plain": advise(*soil),
        "stiff": advise(*soil, "--eu", max(30e6, 20 * c_u), "--method", "verlet"),
        "soft": advise(*soil, "--sensitivity", 4),
    }
    for name, text in texts.items():
        (tmp_path / f"{name}.nml").write_text(text)
        done = perigeo(["--check", f"{name}.nml"], tmp_path)
        assert done.returncode == 0, (name, done.stderr)
        assert "warning" not in done.stdout + done.stderr, (name, done.stdout)


@pytest.mark.parametrize("width", [0.05, 2.0, 50.0])
@pytest.mark.parametrize("more", [(), ("--method", "verlet")])
def test_a_footing_raises_no_doubt(advise, perigeo, tmp_path, width, more):
    text = advise("--cu", 20e3, "--kind", "footing", "--size", width, "--points", 8, *more)
    (tmp_path / "run.nml").write_text(text)
    done = perigeo(["--check", "run.nml"], tmp_path)
    assert done.returncode == 0, done.stderr
    assert "warning" not in done.stdout + done.stderr


@pytest.mark.parametrize("method", ["equilibrium", "verlet"])
@pytest.mark.parametrize(("size", "c_u"), [((0.05, 0.1), 50e3), ((20.0, 40.0), 5e3)])
def test_a_coarse_run_has_the_strength_of_the_soil(advise, run_case, tmp_path, method, size, c_u):
    options = ("--cu", c_u, "--size", *size, "--points", 10, "--method", method)
    (tmp_path / "own.nml").write_text(advise(*options))
    done = run_case(tmp_path / "own.nml", tmp_path, "--output", "out", "--threads=1")
    assert done.returncode == 0, done.stderr
    assert "warning" not in done.stdout
    stress = -history(tmp_path / "out" / "own_test_history.csv")["top_force_y"] / size[0]
    assert stress.max() == pytest.approx(2.0 * c_u, rel=0.02)


def test_softening_goes_to_the_residual_strength(advise, run_case, tmp_path):
    soil = ("--cu", 20e3, "--sensitivity", 2, "--slip", 1e-3, "--size", 0.05, 0.1)
    (tmp_path / "own.nml").write_text(advise(*soil, "--points", 8))
    done = run_case(tmp_path / "own.nml", tmp_path, "--output", "out", "--threads=1")
    assert done.returncode == 0, done.stderr
    stress = -history(tmp_path / "out" / "own_test_history.csv")["top_force_y"] / 0.05
    assert stress.max() == pytest.approx(2.0 * 20e3, rel=0.02)
    assert 20e3 < stress[-1] < 1.4 * 20e3


def test_a_longer_horizon_softens_over_the_same_slip(advise):
    def modulus(text):
        (line,) = (line for line in text.splitlines() if "isotropic_modulus" in line)
        return float(line.split("=")[1].split("!")[0])

    soil = ("--cu", 20e3, "--sensitivity", 4, "--slip", 2e-3, "--size", 0.05, 0.1)
    short = modulus(advise(*soil, "--horizon", 0.01))
    assert modulus(advise(*soil, "--horizon", 0.02)) == pytest.approx(2.0 * short, rel=1e-4)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--cu", "-1", "--size", "1", "2"], "--cu: -1; it must be above 0"),
        (["--cu", "1e4", "--size", "1"], "--size: --kind specimen takes 2, given 1"),
        (["--cu", "1e4", "--size", "1", "2", "--nu", "0.5"], "--nu: 0.5; it must be above 0 and"),
        (["--cu", "1e4", "--size", "1", "2", "--spacing", "0.5"], "fewer than 4 points across 1 m"),
        (["--cu", "1e4", "--size", "1", "2", "--horizon", "0.05"], "is below two spacings"),
        (["--cu", "1e4", "--size", "1", "2", "--slip", "0.1"], "goes with --sensitivity"),
        (["--cu", "1e4", "--size", "1", "2", "--sensitivity", "0.5"], "it must be at least 1"),
    ],
)
def test_what_makes_no_sense_is_refused(capsys, options, message):
    assert main(["advise", *options]) == 1
    assert message in capsys.readouterr().err
