"""A second generator of recordings, for evidence only.

It shares nothing with the package but the layout of a recording's folder: its own mechanics (:mod:`.chain`), camera
(:mod:`.camera`), light (:mod:`.picture`) and files (:mod:`.recording`).
"""
