"""The command line, and the place where the other packages are wired together."""

import contextlib
import ctypes
import os

_M_MMAP_THRESHOLD = -3
_LARGE_BYTES = 1 << 20

# Before numpy is loaded: the matrices are small, and threads of the algebra library that spin for
# work take the one core that controller and simulator share in lockstep.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
# glibc keeps what large arrays leave behind unless it is told where "large" begins; whoever set
# its own variable knows better, as where a page fault is dear.
if "MALLOC_MMAP_THRESHOLD_" not in os.environ:
    with contextlib.suppress(AttributeError, OSError):
        ctypes.CDLL(None).mallopt(_M_MMAP_THRESHOLD, _LARGE_BYTES)
