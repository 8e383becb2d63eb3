"""Fixtures of the tests."""

from collections.abc import Iterator
from pathlib import Path

import flexor
import pytest
from helpers import PROGRAM, prepared, running


@pytest.fixture
def idle() -> Iterator[flexor.Device]:
    """Return a simulator with one channel, which is not armed."""
    with prepared() as dev:
        yield dev


@pytest.fixture
def dev() -> Iterator[flexor.Device]:
    """Return a simulator whose channel 1 plays, at 0 mA."""
    with running() as dev:
        yield dev


@pytest.fixture(scope="session")
def program() -> Path:
    """Return the program `flexor`."""
    if not PROGRAM.exists():
        pytest.skip(f"{PROGRAM} is absent; build it with `cargo build -p host-tool`")
    return PROGRAM
