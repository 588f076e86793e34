"""The command line, and the place where the other packages are wired together."""

import os

# Before numpy is loaded: the matrices are small, and threads of the algebra library that spin for
# work take the one core that controller and simulator share in lockstep.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
