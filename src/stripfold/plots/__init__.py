"""Figures: one module each, stored datasets in, a matplotlib figure out; nothing is solved here."""
