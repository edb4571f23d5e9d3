"""What replay consumes and compares: every value exactly, with a checksum a tick."""
