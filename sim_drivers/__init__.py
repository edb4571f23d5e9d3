"""Stand-ins for every device, backed by one MuJoCo world."""
