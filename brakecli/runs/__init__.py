"""One case: run it, keep a promised error, refuse or warn before it starts."""
