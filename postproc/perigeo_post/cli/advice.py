"""Inputs from a soil and a size, with the reason of every number; doc/own_test.md explains them.

Numbers are scaled, not copied: with horizon, velocity and damping in proportion all bodies are
alike.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import floor, log10, sqrt

BAND = 1.6  # width of a band over the horizon, with the default control
LARGEST_STRAIN = 0.25
DAMPING = 3.2  # C over sqrt(E rho) / height, that of input/compression.nml


@dataclass(frozen=True)
class Soil:
    """Undrained clay."""

    c_u: float  # [Pa]
    youngs: float  # [Pa]
    nu: float
    density: float  # [kg/m^3]
    sensitivity: float  # 1: no softening
    slip: float | None  # in a band, until the residual strength is reached [m]

    @property
    def softens(self) -> bool:
        return self.sensitivity > 1.0

    @property
    def yield_stress(self) -> float:
        return sqrt(3.0) * self.c_u

    @property
    def residual(self) -> float:
        return self.yield_stress / self.sensitivity

    @property
    def peak_strain(self) -> float:
        """Axial strain at which a specimen yields."""
        return 2.0 * self.c_u * (1.0 - self.nu**2) / self.youngs

    def slip_of(self, brittleness: float, height: float) -> float:
        """Slip until the residual strength that makes a specimen so brittle [m].

        Brittleness is the slope of the load after the peak over the elastic one: a band at 45
        degrees shortens the specimen by slip / sqrt(2), and takes 2 tau from its stress.
        """
        drop = 2.0 * sqrt(2.0) * (self.yield_stress - self.residual) / sqrt(3.0)
        return drop * height * (1.0 - self.nu**2) / (self.youngs * brittleness)

    def modulus(self, slip: float, horizon: float) -> float:
        """Softening modulus with which a band of this horizon softens over a slip [Pa]."""
        return -(self.yield_stress - self.residual) * sqrt(3.0) * BAND * horizon / slip


@dataclass(frozen=True)
class Test:
    """What is made of it."""

    name: str
    size: list[float]  # [m]
    spacing: float  # [m]
    horizon: float  # [m]
    method: str


def number(value: float) -> str:
    """A number as engineers write it: 30.0e6, 100.0e3, 0.05, 1.0e-4."""
    text, power = f"{value:.5g}", 0
    if value != 0.0 and not 1.0e-3 <= abs(value) < 1.0e4:
        power = 3 * floor(log10(abs(value) * (1.0 + 1.0e-9)) / 3.0)
        text = f"{value / 10.0**power:.5g}"
    text = text if "." in text else text + ".0"
    return f"{text}e{power}" if power else text


def whole(length: float, spacing: float) -> tuple[float, str]:
    """A length in whole spacings, and a word where it is not the one that was asked for."""
    count = max(1, round(length / spacing))
    fitted = count * spacing
    changed = abs(fitted - length) > 1e-9 * length
    return fitted, f"; {number(length)} was asked for" if changed else ""


def line(text: str, why: str) -> str:
    """A line of a group with its reason."""
    return f"  {text:<34} ! {why}\n"


def exact(value: float) -> str:
    """A length as it is, so that it stays a multiple of the spacing."""
    return repr(float(f"{value:.12g}"))


# --------------------------------------------------------------------------- parts


def head(title: str, expect: str, test: Test) -> str:
    return (
        f"! {title}\n! Made by perigeo-post advise; doc/own_test.md says why. Change what you know "
        f"better.\n{expect}\n&run\n  title = '{title}'\n  name = '{test.name}'\n/\n"
    )


def points(test: Test, softens: bool) -> str:
    m = test.horizon / test.spacing
    why = f"m = {m:.3g}; "
    why += f"bands {number(BAND * test.horizon)} m wide" if softens else "no length in this soil"
    return (
        "&discretisation\n"
        + line(f"spacing = {exact(test.spacing)}", "[m]; halve it and look what moves")
        + line(f"horizon = {exact(test.horizon)}", f"[m]; {why}")
        + line("layout = 'cells'", "the width of the body is exact")
        + "/\n"
    )


def material(soil: Soil, test: Test, measure: str, slip: float | None) -> str:
    text = (
        "&material\n  model = 'j2'\n"
        + line(f"strain_measure = '{measure}'", MEASURES[measure])
        + line(f"density = {number(soil.density)}", "[kg/m^3]")
        + line(f"youngs_modulus = {number(soil.youngs)}", "E_u [Pa]")
        + line(f"poissons_ratio = {number(soil.nu)}", "undrained: near 0.5")
        + line(f"yield_stress = {soil.yield_stress:.8g}", "sqrt(3) c_u [Pa]: plane strain")
    )
    if slip is not None:
        modulus = soil.modulus(slip, test.horizon)
        what = f"[Pa]; residual after a slip of {number(slip)} m"
        text += line(f"isotropic_modulus = {number(modulus)}", what)
        why = f"[Pa]; sensitivity {number(soil.sensitivity)}"
        text += line(f"residual_strength = {soil.residual:.8g}", why)
    return text + "/\n"


MEASURES = {
    "logarithmic": "plastic flow keeps the volume",
    "small": "that of limit theorems",
}


def boundary(name: str, side: str, contact: str, *more: str) -> str:
    body = "".join(more)
    return f"&boundary\n  name = '{name}'\n  side = '{side}'\n  contact = '{contact}'\n{body}/\n"


def integration(soil: Soil, test: Test, end: str, height: float, frame: str) -> str:
    text = f"&integration\n  method = '{test.method}'\n{end}"
    if test.method == "equilibrium":
        count, residual = (200, 1e-4) if soil.softens else (50, 1e-3)
        text += line(f"increments = {count}", "more where the log says so")
        text += line(f"residual = {number(residual)}", "unbalanced force over reactions")
    else:
        damping = DAMPING * sqrt(soil.youngs * soil.density) / height
        text += line(f"damping = {number(damping)}", "[kg/(m^3 s)]; 3.2 sqrt(E rho) / height")
        text += f"  damping_frame = '{frame}'\n"
    return text + "/\n"


def velocity(soil: Soil, test: Test, height: float, strain: float) -> tuple[float, str]:
    """Velocity of a platen [m/s], and why: in time waves pass the body 50 times until it yields."""
    if test.method == "equilibrium":
        return 0.01 * height, "1 % in a second; only the way counts"
    passes = 200.0 if soil.softens else 50.0
    speed = sqrt(soil.youngs / soil.density)
    return strain * speed / passes, f"waves pass {passes:.0f} times until it yields; try a quarter"


# --------------------------------------------------------------------------- kinds


def specimen(soil: Soil, test: Test) -> str:
    """Plane strain compression between smooth platens."""
    width, other = whole(test.size[0], test.spacing)
    height, another = whole(test.size[1], test.spacing)
    strain, slip, later = 4.0 * soil.peak_strain, None, ""
    if soil.softens:
        slip = soil.slip or soil.slip_of(0.5, height)
        strain = soil.peak_strain + 1.2 * slip / (sqrt(2.0) * height)
        later = softening_in_words(soil, soil.slip_of(1.0, height) / slip)
    expect = (
        f"! Expect: sigma_1 = 2 c_u = {number(2.0 * soil.c_u)} Pa at "
        f"{100.0 * soil.peak_strain:.3g} % strain{later}"
    )
    if height < 1.5 * width:
        expect += (
            ".\n! Squat: a square is 3 % too strong with 20 points, 6 % with 10; twice as high 1 %"
        )
    final = min(LARGEST_STRAIN, float(f"{strain:.2g}"))
    v, why = velocity(soil, test, height, soil.peak_strain)
    groups = [
        head("Plane strain compression of undrained clay", expect + ".\n", test),
        points(test, soil.softens),
        "&body\n",
        line(f"x_min = 0.0, x_max = {exact(width)}", "[m]" + other),
        line(f"y_min = 0.0, y_max = {exact(height)}", "[m]" + another),
        "/\n",
        material(soil, test, "logarithmic", slip),
        boundary("bottom", "bottom", "smooth"),
        boundary("top", "top", "smooth", line(f"velocity = 0.0, {number(-v)}", f"[m/s]; {why}")),
        integration(soil, test, f"  final_strain = {final:.4g}\n", height, "platens"),
    ]
    if soil.softens:
        groups += [
            "&imperfection\n",
            line("amplitude = 1.0e-2", "weaker by this part, so that the band has a place"),
            f"  x = 0.0, y = {exact(height / 4.0)}, radius = {exact(test.horizon)}\n/\n",
        ]
    return "".join([*groups, "&output\n  frame_count = 10\n/\n"])


def softening_in_words(soil: Soil, brittleness: float) -> str:
    """What comes after the peak, and how suddenly."""
    text = (
        f", the peak, then {number(2.0 * soil.c_u / soil.sensitivity)} Pa.\n! The slope after the "
        f"peak is about {brittleness:.2g} of the elastic one"
    )
    if brittleness >= 1.0:
        text += ": above 1 the load falls at once, to a state far away"
    return text


def footing(soil: Soil, test: Test) -> str:
    """A rough strip footing on deep clay."""
    width, other = whole(test.size[0], test.spacing)
    side, _ = whole(3.0 * width, test.spacing)
    limit = 5.14 * soil.c_u * width
    settlement = 50.0 * soil.c_u / soil.youngs * width
    expect = f"! Expect: {number(limit)} N/m = (2 + pi) c_u B, Prandtl's load"
    if soil.softens:
        expect += f"; softening takes from it, down to {number(limit / soil.sensitivity)} at most"
    v, why = velocity(soil, test, width, soil.c_u / soil.youngs)
    half = exact(width / 2.0)
    return "".join(
        [
            head("Rough strip footing on undrained clay", expect + ".\n", test),
            points(test, soil.softens),
            "&body\n",
            line(f"x_min = {exact(-side)}, x_max = {exact(side)}", "[m]; 3 B to each side"),
            line(f"y_min = {exact(-side)}, y_max = 0.0", "[m]; 3 B deep"),
            "/\n",
            material(soil, test, "small", soil.slip if soil.softens else None),
            boundary("base", "bottom", "rough"),
            boundary("left", "left", "smooth"),
            boundary("right", "right", "smooth"),
            boundary(
                "footing", "top", "rough",
                line(f"span = -{half}, {half}", "B [m]" + other),
                line(f"velocity = 0.0, {number(-v)}", f"[m/s]; {why}"),
            ),
            integration(
                soil, test,
                line(f"end_time = {number(settlement / v)}", "[s]; settlement 50 c_u / E_u B"),
                3.0 * width, "rest",
            ),
            "&output\n  frame_count = 5\n/\n",
        ]
    )  # fmt: skip
