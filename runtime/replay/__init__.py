"""Runs the loop again over a recording, and says whether it comes to the same."""
