"""The packages, as `cargo deb` makes them of the release build, and the machine they go to."""

import os
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
def bare(tmp_path_factory):
    """A machine to copy."""
    if os.geteuid() != 0:
        pytest.skip("only root can install a machine to try the package on")
    machine = Machine.install(tmp_path_factory.mktemp("machines") / "bare")
    yield machine
    machine.close()


@pytest.fixture(scope="module")
def machine(bare):
    """One that is not booted."""
    machine = bare.copy(bare.root.with_name("machine"))
    yield machine
    machine.close()


@pytest.fixture(scope="module")
def computer(bare):
    """One that is."""
    machine = bare.copy(bare.root.with_name("computer"))
    if not machine.boot():
        machine.close()
        pytest.skip("systemd does not come up in namespaces here")
    yield machine
    machine.close()
