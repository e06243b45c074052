"""Animations of a field over the frames of a run, on one colour scale."""

from __future__ import annotations

import shutil
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from PIL import Image

from ..read.errors import OutputError, PostError, RequestError
from ..read.labels import labels_of
from ..read.outputs import FIGURE, check_output
from ..read.run import Frame
from .contours import (
    Panel,
    Scale,
    common_extent,
    common_scale,
    deformation_note,
    draw_panel,
    panel_of,
)
from .panels import Cell, fill, in_rows, wishes_for
from .style import check_figure_path, new_figure, style

ENDINGS = (".gif", ".mp4")


def animate(
    frames: Sequence[Frame],
    path: str | Path,
    field: str = "plastic_strain",
    deformed: float | None = None,
    fictitious: bool = False,
    low: float | None = None,
    high: float | None = None,
    fps: float = 5.0,
    dpi: int = 150,
) -> Path:
    """Write a GIF or MP4 (by the ending) of a field; all frames share one colour scale."""
    path = check_output(check_figure_path(path, ENDINGS), FIGURE)
    if not frames:
        raise RequestError("no frame to animate")
    if not 0.1 <= fps <= 60.0:
        raise RequestError(f"fps must lie between 0.1 and 60, not {fps:g}")
    if path.suffix.lower() == ".mp4" and shutil.which("ffmpeg") is None:
        raise PostError("MP4 needs the program ffmpeg, which is not there: install it or use .gif")
    panels = [panel_of(f, field, deformed, fictitious) for f in frames]
    unit = frames[0].scalar(field).unit
    scale = common_scale([p.values for p in panels], unit, low, high)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        pictures = _pictures(
            panels, labels_of(frames), scale, field, deformation_note(deformed, frames), dpi
        )
        if path.suffix.lower() == ".gif":
            _write_gif(path, pictures, fps)
        else:
            _write_mp4(path, pictures, fps)
    except OSError as error:
        raise OutputError(f"cannot write {path}: {error.strerror or error}") from error
    return path


def _pictures(
    panels: Sequence[Panel], titles: Sequence[str], scale: Scale, field: str, note: str | None,
    dpi: int,
) -> Iterator[Image.Image]:  # fmt: skip
    """One after the other; nothing but the field and the title changes from one to the next."""
    extent = common_extent(panels)
    longest = max(titles, key=len)
    with style():
        rows = in_rows([Cell(longest, extent, panels[0])], 1, note)
        wishes = wishes_for(rows, 134.0, 120.0)
        layout = rows.layout(wishes, scale)
        figure = new_figure(layout.width, layout.height, layout=None)
        figure.set_dpi(dpi)
        (ax,) = fill(figure, layout, rows, wishes, scale, field)
        for panel, title in zip(panels, titles):
            for artist in [*ax.images, *ax.collections, *ax.patches]:
                artist.remove()
            draw_panel(ax, panel, scale)
            ax.set(xlim=extent[[0, 2]], ylim=extent[[1, 3]], aspect="auto")
            ax.set_title(title, fontsize=wishes.size, pad=2.5)
            yield _rendered(figure)


def _rendered(figure: Figure) -> Image.Image:
    canvas = figure.canvas
    canvas.draw()
    pixels = np.asarray(canvas.buffer_rgba())[..., :3]  # type: ignore[attr-defined]
    height, width = (size - size % 2 for size in pixels.shape[:2])  # MP4 wants even numbers
    return Image.fromarray(np.ascontiguousarray(pixels[:height, :width]))


def _write_gif(path: Path, pictures: Iterator[Image.Image], fps: float) -> None:
    images = [p.quantize(256, dither=Image.Dither.NONE) for p in pictures]
    images[0].save(
        path, save_all=True, append_images=images[1:], duration=max(round(1000.0 / fps), 20),
        loop=0, disposal=1, optimize=False,
    )  # fmt: skip


def _write_mp4(path: Path, pictures: Iterator[Image.Image], fps: float) -> None:
    import subprocess

    first = next(pictures)
    command = [
        "ffmpeg", "-loglevel", "error", "-y", "-f", "rawvideo", "-pix_fmt", "rgb24",
        "-s", f"{first.width}x{first.height}", "-r", f"{fps:g}", "-i", "-",
        "-c:v", "libx264", "-pix_fmt", "yuv420p", str(path),
    ]  # fmt: skip
    with subprocess.Popen(
        command, stdin=subprocess.PIPE, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE
    ) as process:
        assert process.stdin is not None
        assert process.stderr is not None
        try:
            process.stdin.write(first.tobytes())
            for picture in pictures:
                process.stdin.write(picture.tobytes())
            process.stdin.close()
        except BrokenPipeError:
            pass
        words = process.stderr.read().decode(errors="replace").strip()
    if process.returncode != 0:
        raise OutputError(f"ffmpeg could not write {path}: {words.splitlines()[-1:] or ['?']}")
