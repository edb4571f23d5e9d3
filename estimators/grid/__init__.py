"""From one frame of a range sensor to labelled cells."""
