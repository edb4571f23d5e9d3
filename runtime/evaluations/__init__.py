"""What `trundle evaluate` does: experiments, the kinds of them, and their tables."""
