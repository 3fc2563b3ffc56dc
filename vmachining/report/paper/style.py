"""Sizes, colours and fonts of figures for papers, and their files."""

from __future__ import annotations

import io
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

from vmachining.errors import InputError
from vmachining.job.files import atomic_path, make_folder

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

FORMATS = ("svg", "pdf", "png")
WIDTH_MM = 174.0
"""Two columns of most journals."""
MM_PER_INCH = 25.4
PNG_DPI = 300

BLUE, ORANGE, GREEN, RED, VIOLET, GREY = "#0072b2", "#e69f00", "#009e73", "#d55e00", "#cc79a7", "#6b7280"
"""Colours that readers with any colour vision tell apart [Okabe and Ito 2008]."""

LOOK: Any = {
    "font.family": "sans-serif", "font.sans-serif": ["DejaVu Sans"], "font.size": 8.0, "axes.labelsize": 8.0,
    "axes.titlesize": 8.0, "legend.fontsize": 7.5, "xtick.labelsize": 7.5, "ytick.labelsize": 7.5,
    "axes.linewidth": 0.6, "axes.spines.top": False, "axes.spines.right": False, "axes.grid": True,
    "axes.axisbelow": True, "grid.color": "#e5e7eb", "grid.linewidth": 0.5, "lines.linewidth": 1.0,
    "xtick.major.width": 0.6, "ytick.major.width": 0.6, "xtick.direction": "out", "ytick.direction": "out",
    "legend.frameon": False, "figure.dpi": 150.0, "savefig.dpi": PNG_DPI,
    "pdf.fonttype": 42,   # TrueType outlines inside of the file: text stays text, on any machine
    "ps.fonttype": 42,
    "svg.fonttype": "path",  # SVG cannot hold a font: letters are outlines
    "svg.hashsalt": "vmachining",
}  # fmt: skip


@contextmanager
def look() -> Iterator[None]:
    """The style, for as long as it is requested.

    Raises InputError: matplotlib is not installed.
    """
    try:
        import matplotlib as mpl
    except ImportError as exc:
        raise InputError("figures need matplotlib", remedy="pip install matplotlib") from exc
    with mpl.rc_context(LOOK):
        yield


@cache
def _shown() -> type[Figure]:
    """A figure that a notebook shows without pyplot."""
    from matplotlib.figure import Figure

    class Shown(Figure):
        def _repr_png_(self) -> bytes:
            file = io.BytesIO()
            with look():
                self.savefig(file, format="png", dpi=self.get_dpi(), facecolor="white")
            return file.getvalue()

    return Shown


def canvas(width_mm: float, height_mm: float) -> Figure:
    """An empty figure that lays itself out, and that a notebook shows."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg

    figure = _shown()(figsize=(width_mm / MM_PER_INCH, height_mm / MM_PER_INCH), layout="constrained")
    FigureCanvasAgg(figure)
    return figure


def shades(count: int) -> list[tuple[float, float, float]]:
    """Colours from blue to red for places in a row."""
    share = [k / max(count - 1, 1) for k in range(count)]
    return [(0.08 + 0.78 * s, 0.43 - 0.23 * s, 0.75 - 0.5 * s) for s in share]


def panels(
    count: int, *, width_mm: float, each_mm: float, heights: Sequence[float] | None = None
) -> tuple[Figure, list[Axes]]:
    """A figure of panels below each other that share their x axis."""
    figure = canvas(width_mm, each_mm * (sum(heights) if heights else count) + 12.0)
    grid = figure.subplots(
        count, 1, sharex=True, squeeze=False, height_ratios=list(heights) if heights else None
    )
    return figure, list(grid[:, 0])


PLAIN: dict[str, dict[str, Any]] = {
    "svg": {"Date": None, "Creator": "vmachining"}, "pdf": {"CreationDate": None, "ModDate": None, "Creator": "vmachining"},
    "png": {"Software": "vmachining"},
}  # fmt: skip
"""No dates; the name by which a file is known as ours."""


def write_figures(figures: dict[str, Figure], folder: Path, formats: Sequence[str]) -> list[Path]:
    """Write figure_KIND.FORMAT of each into a folder, whole or not at all; the files written."""
    make_folder(folder)
    return [
        path
        for kind, figure in figures.items()
        for path in write_figure(figure, *(folder / f"figure_{kind}.{suffix}" for suffix in formats))
    ]


def write_figure(figure: Figure, *paths: Path) -> tuple[Path, ...]:
    """Write one figure to files, whole or not at all; their names end in one of `FORMATS`."""
    with look():
        for _ in range(2):  # the layout settles, and then it is the same in every format
            figure.draw_without_rendering()
        figure.set_layout_engine("none")
        for path in paths:
            suffix = path.suffix[1:].lower()
            with atomic_path(path) as temporary:
                figure.savefig(temporary, format=suffix, metadata=PLAIN[suffix], facecolor="white")
        for axes in figure.axes:
            axes.clear()
    return paths


def is_picture(path: Path, option: str) -> bool:
    """True for a name of a picture, False for one of a page. InputError: it ends in neither."""
    suffix = path.suffix[1:].lower()
    if suffix not in ("html", "htm", *FORMATS):
        raise InputError(f"{option} {path}: expected a name that ends in .html, .{', .'.join(FORMATS)}")
    return suffix in FORMATS
