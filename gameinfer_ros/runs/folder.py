"""Where results go."""

from __future__ import annotations

import os
from datetime import datetime
from pathlib import Path


def make_folder(out: Path | None, name: str) -> Path:
    """Make the folder `out`, or if there is none a new one in results/ that is called by `name`.

    Raises:
        OSError: it cannot be made.
    """
    if out is None:
        moment = datetime.now().strftime("%Y%m%d-%H%M%S")
        out = Path("results") / f"{moment}-{name}-{os.getpid()}"
    out.mkdir(parents=True, exist_ok=True)
    return out
