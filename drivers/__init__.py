"""Real devices, one file or folder each; `drivers.interface` is the ground floor that everyone shares."""
