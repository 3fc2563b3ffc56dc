"""Reads the container of a page again, by its description in `vmachining.report.payload`."""

from __future__ import annotations

import base64
import gzip
import json
import re
import struct

import numpy as np


def unpacked(page):
    """Header and arrays by name."""
    text = re.search(r'<script id="data" type="application/octet-stream">(.*?)</script>', page, re.S)[1]
    body = gzip.decompress(base64.b64decode(text))
    (length,) = struct.unpack_from("<I", body)
    head = json.loads(body[4 : 4 + length])
    arrays = {
        name: np.frombuffer(body, f"<{place['kind']}", place["length"], 4 + length + place["offset"])
        for name, place in head["arrays"].items()
    }
    return head, arrays
