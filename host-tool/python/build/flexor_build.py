"""Build backend of this folder: builds the distribution that the repository describes."""

import os
from pathlib import Path
from typing import Any

import maturin

_ROOT = Path(__file__).resolve().parents[3]


def get_requires_for_build_wheel(settings: Any = None) -> list[str]:
    """Return what building a wheel needs."""
    os.chdir(_ROOT)
    return maturin.get_requires_for_build_wheel(settings)


def prepare_metadata_for_build_wheel(folder: str, settings: Any = None) -> str:
    """Write the metadata of the wheel into `folder`."""
    os.chdir(_ROOT)
    return maturin.prepare_metadata_for_build_wheel(folder, settings)


def build_wheel(folder: str, settings: Any = None, metadata: str | None = None) -> str:
    """Build the wheel into `folder`."""
    os.chdir(_ROOT)
    return maturin.build_wheel(folder, settings, metadata)
