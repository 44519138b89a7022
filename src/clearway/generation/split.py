"""Which split owns a plan: a hash of its cells decides, so that no two splits ever share a plan, and no list is kept.

Plans are equal where their cells are, once moved, turned or mirrored. All of these have one canonical form.
"""

from __future__ import annotations

import hashlib

import numpy as np

from clearway.choices import SplitName

PARTS = 4
OWNERS: tuple[SplitName, ...] = ("test", "validation")  # of the first parts; "train" has all others


def canonical_form(cells: np.ndarray) -> np.ndarray:
    """The cells, (C, 2) int, moved, turned and mirrored into one form for all plans that are equal so: (C, 2) int64."""
    forms = []
    for turned in (cells.astype(np.int64), cells[:, ::-1].astype(np.int64)):
        for signs in ((1, 1), (1, -1), (-1, 1), (-1, -1)):
            form = turned * np.array(signs)
            form -= form.min(axis=0)
            forms.append(form[np.lexsort((form[:, 1], form[:, 0]))])
    return min(forms, key=lambda form: form.astype(">i8").tobytes())


def canonical_hash(cells: np.ndarray) -> str:
    """SHA-256 of the canonical form, as hexadecimal digits."""
    return hashlib.sha256(canonical_form(cells).astype("<i8").tobytes()).hexdigest()


def owner(cells: np.ndarray) -> SplitName:
    """The split to which a plan of these cells belongs: a quarter each to test and validation, half to train."""
    part = int(canonical_hash(cells)[:8], 16) % PARTS
    return OWNERS[part] if part < len(OWNERS) else "train"
