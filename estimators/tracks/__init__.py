"""What moves: discs followed from frame to frame, fiducial markers, or the truth."""
