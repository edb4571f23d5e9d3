"""Risk-sensitive conjectural scenario planning."""
