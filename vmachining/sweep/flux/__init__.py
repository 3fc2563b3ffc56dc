"""Swept volume by the flux of the moving body: V = V(K) + Phi - W."""

from vmachining.sweep.flux.volume import FluxVolume, flux_volume

__all__ = ["FluxVolume", "flux_volume"]
