"""Pictures of sweeps: curves over one axis, maps over two, rows of maps over three."""
