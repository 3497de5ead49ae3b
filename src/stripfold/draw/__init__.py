"""Figures and films of results: arrays and datasets in, a matplotlib figure out; nothing is solved here."""

from stripfold.base.extras import require

require("plot")
