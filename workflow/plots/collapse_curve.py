"""The control-parameter/deflection curve through a collapse, as the package draws it."""

from stripfold.draw.collapse_curve import draw

__all__ = ["draw"]
