"""Columns."""

from vmachining.engines.columns.engine import ColumnsEngine, FlatStock

__all__ = ["ColumnsEngine", "FlatStock"]
