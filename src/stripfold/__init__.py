"""Replication of "Static Stability of Robotic Fabric Strip Folding"."""

__version__ = "0.1.0"
