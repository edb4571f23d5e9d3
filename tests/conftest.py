"""Hypothesis draws the same examples everywhere and never judges by the wall clock."""

from hypothesis import settings

settings.register_profile("trundle", deadline=None, derandomize=True, max_examples=100)
settings.load_profile("trundle")
