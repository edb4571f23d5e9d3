"""The runtime: loop, pacer, supervisor, recorder, configuration, command line.  Nothing of ours imports it."""
