"""Where the points of a sweep are computed: processes here, or a dask cluster."""
