"""Frames against the straight walls seen before."""
