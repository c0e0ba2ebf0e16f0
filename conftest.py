"""For every test: one thread of linear algebra, as in the library's own work; two of them wait for each other."""

import os

for name in ("OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "OMP_NUM_THREADS"):
    os.environ.setdefault(name, "1")  # before numpy is loaded; programs that tests start inherit it
