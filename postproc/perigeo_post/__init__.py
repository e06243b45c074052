"""Results of perigeo in Python: reader, measures and figures.

Example::

    from perigeo_post import Run, measure_band, contour_figure, save_figure

    run = Run("results/compression/compression.h5")
    print(measure_band(run, strain=0.01).as_dict())
    save_figure(contour_figure(run.frames()[1:]), "bands.pdf")

Everything that the command line does is a function here.
"""

from .draw.animation import animate
from .draw.contours import contour_figure
from .draw.figures import (
    band_figure,
    column_figure,
    compare_figure,
    curve_figure,
    energy_figure,
    profile_figure,
    stress_strain_figure,
)
from .draw.style import save_figure
from .measure.band import (
    Band,
    BandMeasure,
    BandSystem,
    Line,
    Profile,
    Width,
    line_across,
    profile_along,
    profile_width,
)
from .measure.band_search import find_bands
from .measure.curves import (
    Curve,
    Modulus,
    apparent_modulus,
    axial_stress,
    curve_numbers,
    energy_curves,
    history_curve,
    peak,
    stress_strain,
)
from .measure.export import (
    to_json,
    write_bands,
    write_curves,
    write_points,
    write_profiles,
    write_rows,
)
from .measure.measures import (
    compare_runs,
    frame_bands,
    frame_profile,
    labels_for,
    largest_plastic_strain,
    measure_band,
    run_facts,
)
from .read.errors import (
    FieldNotFoundError,
    FrameNotFoundError,
    NoBandError,
    OutputError,
    PostError,
    RequestError,
    ResultError,
    SchemaError,
)
from .read.fields import Field
from .read.history import History, read_history
from .read.points import PointSet
from .read.run import SCHEMA, SCHEMA_VERSIONS, Frame, Run
from .study.run import StudyError, StudyOptions, run_study

__version__ = "0.1.0"

__all__ = [
    "SCHEMA",
    "SCHEMA_VERSIONS",
    "Band",
    "BandMeasure",
    "BandSystem",
    "Curve",
    "Field",
    "FieldNotFoundError",
    "Frame",
    "FrameNotFoundError",
    "History",
    "Line",
    "Modulus",
    "NoBandError",
    "OutputError",
    "PointSet",
    "PostError",
    "Profile",
    "RequestError",
    "ResultError",
    "Run",
    "SchemaError",
    "StudyError",
    "StudyOptions",
    "Width",
    "__version__",
    "animate",
    "apparent_modulus",
    "axial_stress",
    "band_figure",
    "column_figure",
    "compare_figure",
    "compare_runs",
    "contour_figure",
    "curve_figure",
    "curve_numbers",
    "energy_curves",
    "energy_figure",
    "find_bands",
    "frame_bands",
    "frame_profile",
    "history_curve",
    "labels_for",
    "largest_plastic_strain",
    "line_across",
    "measure_band",
    "peak",
    "profile_along",
    "profile_figure",
    "profile_width",
    "read_history",
    "run_facts",
    "run_study",
    "save_figure",
    "stress_strain",
    "stress_strain_figure",
    "to_json",
    "write_bands",
    "write_curves",
    "write_points",
    "write_profiles",
    "write_rows",
]
