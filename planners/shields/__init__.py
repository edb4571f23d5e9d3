"""Shields: the last say on a command."""
