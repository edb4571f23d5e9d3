"""The commands of `trundle`, one file each; what they do lives elsewhere and is imported when one of them is called."""
