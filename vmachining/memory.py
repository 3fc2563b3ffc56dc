"""Free memory of the machine, peak memory of this process, and freed memory that goes back to the system."""

from __future__ import annotations

import ctypes
import os
import resource
import sys
from contextlib import suppress
from pathlib import Path


def available_bytes() -> int:
    """Memory that a process can still get: what the system has free, or its container allows."""
    known = []
    with suppress(OSError, ValueError, AttributeError):
        known.append(os.sysconf("SC_AVPHYS_PAGES") * os.sysconf("SC_PAGE_SIZE"))
    with suppress(OSError, ValueError, IndexError):
        lines = Path("/proc/meminfo").read_text(encoding="ascii").splitlines()
        known = [1024 * int(line.split()[1]) for line in lines if line.startswith("MemAvailable:")] or known
    with suppress(OSError, ValueError):
        limit = int(Path("/sys/fs/cgroup/memory.max").read_text(encoding="ascii"))
        used = int(Path("/sys/fs/cgroup/memory.current").read_text(encoding="ascii"))
        known.append(max(0, limit - used))
    return min(known, default=1 << 32)


def peak_mb() -> float:
    """Largest memory of this process so far. `getrusage` alone would count what its parent had when it was started."""
    try:
        status = Path("/proc/self/status").read_text()
        return float(status.split("VmHWM:")[1].split()[0]) / 1024.0
    except (OSError, IndexError, ValueError):
        peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
        return peak / (1024.0 * 1024.0 if sys.platform == "darwin" else 1024.0)


def give_back() -> None:
    """Return freed memory to the system: once arrays of 32 MB have come and gone, glibc keeps what lies between pieces in use."""
    with suppress(AttributeError, OSError, TypeError):
        ctypes.CDLL(None).malloc_trim(0)
