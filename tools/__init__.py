"""The command line, and the place where the other packages are connected."""

import contextlib
import ctypes
import os

_M_MMAP_THRESHOLD = -3
_LARGE_BYTES = 1 << 20

# Set this before numpy is loaded. The matrices are small, so more threads gain nothing. Idle
# threads of the algebra library spin, and would occupy the core that controller and simulator share
# in lockstep.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
# glibc keeps the memory that large arrays have freed, unless the threshold for "large" is set. A
# threshold set by the user takes precedence, for example on machines with slow page faults.
if "MALLOC_MMAP_THRESHOLD_" not in os.environ:
    with contextlib.suppress(AttributeError, OSError):
        ctypes.CDLL(None).mallopt(_M_MMAP_THRESHOLD, _LARGE_BYTES)
