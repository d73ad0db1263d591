""".usdz: a stage and its images in one uncompressed archive, the same bytes for the same content."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path

from anim.caches.temporary_files import temporary_folder

ARCHIVE_TIME_S = 315_532_800  # 1980-01-01, the first time of a ZIP file; else the clock is in the bytes


def write_package(path: str, stage: str, images: Sequence[tuple[str, bytes]], *, name: str) -> None:
    """Write a .usdz at `path` from a stage's file, which comes first as `name`, and images by name."""
    from pxr import Sdf

    with temporary_folder() as folder, Sdf.ZipFileWriter.CreateNew(path) as package:
        os.utime(stage, (ARCHIVE_TIME_S, ARCHIVE_TIME_S))
        package.AddFile(stage, name)
        for name, data in images:
            file = Path(folder) / name
            with file.open("wb") as target:
                target.write(data)
            os.utime(file, (ARCHIVE_TIME_S, ARCHIVE_TIME_S))
            package.AddFile(str(file), name)
