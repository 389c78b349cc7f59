"""How fast brakecli is, beside general solvers; see `__main__`."""
