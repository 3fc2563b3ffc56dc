"""The raw workpiece of a job, as any engine has it."""

from __future__ import annotations

from dataclasses import replace

from vmachining.engines import engine_class
from vmachining.engines.protocol import Engine, Options
from vmachining.job.deviation import vector_settings
from vmachining.job.jobfile import Job
from vmachining.job.stock import design_mesh
from vmachining.stock import Stock

__all__ = ["raw_engine"]


def raw_engine(job: Job, name: str, stock: Stock) -> Engine:
    """The workpiece before the first block, with what the job asks of the engine `name`.

    Raises
    ------
    InputError
        No such engine, or it takes neither the stock nor what is asked.
    """
    keys = job.keys.accuracy
    asked = Options(
        chord=keys.chord_mm, width=keys.width, width_mm3=keys.width_mm3, spacing=keys.spacing_mm,
        directions=keys.directions,
    )  # fmt: skip
    if name == "vectors":
        asked = replace(asked, design=design_mesh(job), vectors=vector_settings(job))
    return engine_class(name).of(stock, asked)
