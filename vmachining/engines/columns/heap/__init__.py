"""The heap of cells, for columns that stand upright and in any direction."""
