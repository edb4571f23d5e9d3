"""Where a log goes: files that survive what happens to the disk and the process, and the live view."""
