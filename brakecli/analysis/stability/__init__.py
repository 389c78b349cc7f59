"""Linear stability of steady sliding: modes, critical friction, and what a scheme makes of them."""
