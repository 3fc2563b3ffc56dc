"""Top and outline of a stock that is a height field of facets over a level bottom."""

from vmachining.engines.columns.roof.facets import Facets, facets_of, roof_of, seams

__all__ = ["Facets", "facets_of", "roof_of", "seams"]
