"""The packages, as `cargo deb` makes them of the release build, and the machine they go to."""

import os
import shutil
import subprocess
from pathlib import Path

import pytest
from machine import Machine

ROOT = Path(__file__).resolve().parents[2]


def build(target, revision):
    """Makes the package of what cargo has built."""
    command = ["cargo", "deb", "--no-build", "--quiet", "--deb-revision", revision]
    done = subprocess.run([*command, "--output", str(target)], cwd=ROOT, capture_output=True, text=True)
    assert done.returncode == 0, f"run `cargo build --release` first: {done.stderr}"
    [deb] = target.glob(f"*-{revision}_*.deb")
    return deb


@pytest.fixture(scope="session")
def deb(tmp_path_factory):
    return build(tmp_path_factory.mktemp("packages"), "1")


@pytest.fixture(scope="session")
def next_deb(tmp_path_factory):
    return build(tmp_path_factory.mktemp("packages"), "2")


@pytest.fixture(scope="session")
def machine(tmp_path_factory):
    if os.geteuid() != 0:
        pytest.skip("only root can install a machine to try the package on")
    root = tmp_path_factory.mktemp("machine") / "root"
    yield Machine.install(root)
    shutil.rmtree(root, ignore_errors=True)
