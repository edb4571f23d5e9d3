"""The graceful controller."""
