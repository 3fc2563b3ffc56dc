"""The raw workpiece of a job, as any engine has it."""

from __future__ import annotations

from dataclasses import replace

from vmachining.engines import engine_class
from vmachining.engines.protocol import Engine, Options
from vmachining.errors import InputError, StockError
from vmachining.job.deviation import vector_settings
from vmachining.job.jobfile import Job
from vmachining.job.stock import design_mesh
from vmachining.stock import Stock


def raw_engine(job: Job, name: str, stock: Stock) -> Engine:
    """The workpiece before the first block, with what the job asks of the engine `name`.

    Raises InputError: No such engine, or it takes neither the stock nor what is asked.
    """
    keys = job.keys.accuracy
    asked = Options(
        chord=keys.chord_mm, width=keys.width, width_mm3=keys.width_mm3, spacing=keys.spacing_mm,
        directions=keys.directions,
    )  # fmt: skip
    if name != "vectors":
        return engine_class(name).of(stock, asked)
    try:
        asked = replace(asked, design=design_mesh(job), vectors=vector_settings(job))
        return engine_class(name).of(stock, asked)
    except InputError as exc:
        if exc.file is not None:
            raise
        # of the engine, which knows no files
        table = "vectors" if job.keys.vectors is not None and not isinstance(exc, StockError) else "design"
        place = job.where(table) if job.keys.design is not None else job.where()
        raise type(exc)(exc.message, **place, remedy=exc.remedy) from exc
