"""What all interop tests share: the router's binary, and a stage that is cleared at the end."""

import os
from pathlib import Path

import pytest
from stage import Stage

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture(scope="session")
def mavswitch():
    """The binary: the one that MAVSWITCH names, or what cargo has built."""
    built = [ROOT / "target" / profile / "mavswitch" for profile in ("release", "debug")]
    named = os.environ.get("MAVSWITCH")
    for path in [Path(named).resolve()] if named else built:
        if path.is_file():
            return path
    pytest.exit("no mavswitch binary: run `cargo build --release`, or set MAVSWITCH", returncode=2)


@pytest.fixture
def stage(mavswitch):
    stage = Stage(mavswitch)
    yield stage
    stage.close()
