"""The folder of results."""

import os
from datetime import datetime
from pathlib import Path


def make_folder(out: Path | None, name: str) -> Path:
    """Create the folder `out`; if it is None, a new one in `results/` with `name` in its name.

    Raises:
        OSError: the folder cannot be created.
    """
    if out is None:
        moment = datetime.now().strftime("%Y%m%d-%H%M%S")
        out = Path("results") / f"{moment}-{name}-{os.getpid()}"
    out.mkdir(parents=True, exist_ok=True)
    return out
