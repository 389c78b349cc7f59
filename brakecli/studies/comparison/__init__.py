"""Error against cost: every scheme, its weights, starts and iterations, over a ladder of steps."""
