"""The tests; their linear algebra has one thread, as in a sweep's workers: idle threads spin on others' cores."""

import os

os.environ.update(dict.fromkeys(("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"), "1"))
