"""The folder of results."""

import os
from datetime import datetime
from pathlib import Path


def make_folder(out: Path | None, name: str, *subfolders: str) -> Path:
    """Create the folder `out`; if it is None, a new one in `results/` with `name` in its name.

    Raises:
        OSError: a folder cannot be created; the message names the option `--out`.
    """
    if out is None:
        moment = datetime.now().strftime("%Y%m%d-%H%M%S")
        out = Path("results") / f"{moment}-{name}-{os.getpid()}"
    try:
        for folder in (out, *(out / subfolder for subfolder in subfolders)):
            folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise OSError(f"--out: {out} cannot be created: {error}") from None
    return out
