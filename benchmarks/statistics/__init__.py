"""Large draws of random runs that keep a tolerance, against a reference that shares no code with brakecli."""
