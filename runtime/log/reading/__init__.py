"""What is done with a log afterwards: read, verify, repair, cut, review."""
