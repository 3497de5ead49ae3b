"""Figures and films of results: arrays and datasets in, a matplotlib figure out; nothing is solved here."""

from stripfold.base.errors import require

require("plot")
