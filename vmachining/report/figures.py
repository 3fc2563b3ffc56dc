"""Small pages of pictures and tables in the style of the report: rotary angles, machines, logged times, forces."""

from __future__ import annotations

import base64
import html
import io
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from vmachining.errors import InputError
from vmachining.job.files import write_atomic
from vmachining.report.numbers import chip, trusted
from vmachining.report.page import rendered

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from vmachining.report.scene import Scene


@dataclass(frozen=True, slots=True, kw_only=True)
class Panel:
    """svg : trusted markup of our own. head, rows : a table."""

    title: str
    svg: str = ""
    text: str = ""
    head: Sequence[str] = ()
    rows: Sequence[Sequence[Any]] = field(default_factory=tuple)


def picture(figure: Figure, words: str, *, kind: str = "svg") -> str:
    """A matplotlib figure as markup for a panel. words : what it shows. kind : "png" for many cells."""
    file = io.BytesIO()
    figure.savefig(file, format=kind, facecolor="white", metadata={"Date": None} if kind == "svg" else None)
    form = {"svg": "svg+xml", "png": "png"}[kind]
    data = base64.b64encode(file.getvalue()).decode("ascii")
    return f'<img alt="{html.escape(words)}" src="data:image/{form};base64,{data}">'


def html_name(path: Path, option: str) -> Path:
    """The path. InputError if its name does not end in .html."""
    if path.suffix.lower() not in (".html", ".htm"):
        raise InputError(f"{option} {path}: needs a name that ends in .html")
    return path


def write_page(
    path: Path,
    panels: Sequence[Panel],
    *,
    kind: str,
    name: str,
    subtitle: str,
    chips: Sequence[tuple[str, str]] = (),
    scene: Scene | None = None,
) -> None:
    """Write one page, whole or not at all. chips : (ok, warn, bad or "", words). scene : a view above the panels."""
    shown = [
        {"title": p.title, "svg": trusted(p.svg), "text": p.text, "head": list(p.head), "rows": [list(r) for r in p.rows]}
        for p in panels
    ]  # fmt: skip
    page = rendered(
        "figures.html.j2", None if scene is None else scene.payload(), scene=scene,
        kind=kind, name=name, subtitle=subtitle, panels=shown,
        chips=[chip(*words) for words in chips],
    )  # fmt: skip
    write_atomic(path, page)
