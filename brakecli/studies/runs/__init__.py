"""One case: run it, keep a requested error, refuse or warn before it starts."""
