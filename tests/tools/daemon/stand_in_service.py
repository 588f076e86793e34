"""Run as a program: stands in for the daemon's service process."""

from __future__ import annotations

import launcher_rig

if __name__ == "__main__":
    launcher_rig.service()
