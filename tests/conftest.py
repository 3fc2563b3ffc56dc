"""Invented cases are the same in every run, so that a change is judged by the change.

VMACHINING_EXPLORE=1 invents new ones: what it finds becomes a case of its own.
"""

import os

from hypothesis import settings

settings.register_profile("repeatable", derandomize="VMACHINING_EXPLORE" not in os.environ, deadline=None)
settings.load_profile("repeatable")
