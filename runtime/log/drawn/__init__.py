"""What a person sees of a log: the scene, plots, words, and the layouts they stand in."""
