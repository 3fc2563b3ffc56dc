"""How a program is to be read: everything that the program itself does not say."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from vmachining.nc.model import Point
from vmachining.nc.tooltable import ToolEntry

__all__ = ["Settings"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Settings:
    """Options of `parse_program`, explained there."""

    dialect: str = "iso"
    tools: Mapping[int, ToolEntry] | None = None
    home: Point = (0.0, 0.0, 100.0)
    block_delete: bool = False
    work_offsets: Mapping[int, Point] = field(default_factory=dict)
    rotary: str = ""
    crc_entry: str = "prev"
    crc_corner: str = "arc"
    peck_clearance_mm: float = 0.254
    taps: str = "reference"
    dwell: str = "s"
    subroutines: tuple[Path, ...] = ()
    start_line: int = 1
    max_steps: int = 1_000_000
    stock_top_mm: float | None = None
