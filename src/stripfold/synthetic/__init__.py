"""Recordings that are computed, not filmed: a strip's motion through a real camera model, and everything around it.

They are what the measurement is judged by, since their truth is known.  Whatever is written here says that it is
synthetic: in its title, in its files and in each of its pictures.
"""

from stripfold.extras import require

require("vision")
