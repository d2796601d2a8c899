"""The Debian package in the course of its life: made, installed, configured, run, upgraded, removed.

The tests share one machine and go on where the one before has ended, so they run as they stand.
"""

import re
import subprocess
import time
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
CONFIG = "/etc/mavswitch/mavswitch.toml"
ENABLED = "/etc/systemd/system/multi-user.target.wants/mavswitch.service"
FIRST_LINES = """\
endpoint.fc.address = "/dev/ttyACM0"
endpoint.gcs.address = "udpin:0.0.0.0:14550"
"""
NOT_STARTED = "not started: no endpoint is configured yet"


@pytest.fixture(scope="module")
def before(machine):
    """What was there before the package."""
    return machine.files()


def condition(machine):
    """Whether systemd would start the service, and what it would log."""
    script = re.fullmatch(r"\+/bin/sh -c '(.*)'", machine.setting("ExecCondition")).group(1)
    done = machine.run("/bin/sh", "-c", script)
    return done.returncode == 0, done.stdout


def in_readme(text):
    """What the README tells to type, which it has to tell."""
    assert text in (ROOT / "README.md").read_text(), f"the README does not say {text!r}"
    return text


def test_lintian_finds_nothing(deb):
    command = ["lintian", "--allow-root", "--fail-on", "error,warning", str(deb)]
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 0 and not done.stdout, done.stdout + done.stderr


def test_it_needs_the_c_library_alone(deb):
    command = ["dpkg-deb", "--field", str(deb), "Depends"]
    depends = subprocess.run(command, check=True, capture_output=True, text=True).stdout
    assert re.fullmatch(r"libc6 \(>= [\d.]+\)\n", depends), depends


def test_its_changelog_is_of_this_version():
    version = re.search(r'^version = "(.*)"', (ROOT / "Cargo.toml").read_text(), re.M).group(1)
    changelog = (ROOT / "packaging/debian/changelog").read_text()
    assert changelog.startswith(f"mavswitch ({version}-1) ")


def test_installed_it_is_enabled_and_says_that_it_is_not_configured(machine, before, deb):
    in_readme("sudo apt install ./target/debian/mavswitch_*.deb\n")
    text = machine.apt_install(deb)
    assert text.count(NOT_STARTED) == 1, text
    assert machine.path(ENABLED).is_symlink()
    assert machine.do("systemctl", "is-enabled", "mavswitch") == "enabled\n"
    assert not any(path.startswith("/usr/local") for path in machine.files() - before)


def test_everything_is_in_its_place(machine):
    version = machine.do("mavswitch", "--version")
    assert re.fullmatch(r"mavswitch \d+\.\d+\.\d+\n", version)
    conffiles = machine.do("dpkg-query", "--show", "--showformat", "${Conffiles}", "mavswitch")
    assert [line.split()[0] for line in conffiles.splitlines() if line] == [CONFIG]
    for path in [
        "/usr/share/man/man1/mavswitch.1.gz",
        "/usr/share/man/man1/mavlink-routerd.1.gz",
        "/usr/share/man/man5/mavswitch-control.5.gz",
        "/usr/share/man/man5/mavswitch.toml.5.gz",
        "/usr/share/bash-completion/completions/mavswitch",
        "/usr/share/zsh/vendor-completions/_mavswitch",
        "/usr/share/fish/vendor_completions.d/mavswitch.fish",
        "/usr/share/doc/mavswitch/copyright",
    ]:
        # dpkg itself leaves out documentation on a machine that is told to.
        assert path in machine.do("dpkg", "--listfiles", "mavswitch").splitlines()
    bash = "source /usr/share/bash-completion/completions/mavswitch; complete -p mavswitch"
    assert "mavswitch" in machine.do("bash", "-c", bash)


def test_no_name_of_mavlink_router_is_taken_and_a_link_takes_it(machine):
    assert machine.run("mavlink-routerd", "--version").returncode == 127
    link = machine.path("/usr/local/bin/mavlink-routerd")
    link.symlink_to("/usr/bin/mavswitch")
    assert "mavswitch" in machine.do("/usr/local/bin/mavlink-routerd", "--version")
    link.unlink()


def test_systemd_finds_nothing_wrong_with_the_unit(machine):
    done = machine.run("systemd-analyze", "verify", "--man=no", "mavswitch.service")
    own = [line for line in done.stderr.splitlines() if "mavswitch" in line]
    assert done.returncode == 0 and not own, done.stderr


def test_until_it_is_configured_the_service_is_skipped(machine):
    is_met, text = condition(machine)
    assert not is_met and NOT_STARTED in text


def test_edited_as_the_readme_says_it_starts_and_tells_its_manager_all(machine):
    path = machine.path(CONFIG)
    text = path.read_text()
    for line in in_readme(FIRST_LINES).splitlines():
        assert text.count(f"\n#{line}\n") == 1, line
        text = text.replace(f"#{line}", line)
    path.write_text(text)
    assert condition(machine) == (True, "")
    machine.do("mavswitch", "check")

    service = machine.service(WATCHDOG_USEC="1000000")
    try:
        assert service.hear() == "READY=1\nSTATUS=0 links, 0 components; waiting for fc"
        started = time.monotonic()
        assert service.hear() == "WATCHDOG=1"
        assert service.hear() == "WATCHDOG=1"
        assert time.monotonic() - started > 0.5, "twice in its time, and not more often"
        service.reload(machine.setting("ExecReload"))
        told = service.hear_all_but("WATCHDOG=1", 2)
        assert re.fullmatch(r"RELOADING=1\nMONOTONIC_USEC=\d+", told[0])
        assert told[1] == "READY=1\nSTATUS=0 links, 0 components; waiting for fc"
        status, log = service.stop()
        assert (service.hear_all_but("WATCHDOG=1", 1), status) == (["STOPPING=1"], 0)
        assert "gcs: listening on 0.0.0.0:14550" in log and "waiting for it" in log, log
    finally:
        service.close()


def test_a_wrong_configuration_is_a_failure_that_a_restart_does_not_repeat(machine):
    path = machine.path("/etc/mavswitch/conf.d/10-wrong.toml")
    path.parent.mkdir()
    path.write_text("[endpoint.gcs]\nadress = 1\n")
    assert condition(machine) == (True, "")
    done = machine.run(machine.setting("ExecStart"))
    assert str(done.returncode) == machine.setting("RestartPreventExitStatus")
    assert "10-wrong.toml:2:1: " in done.stderr, done.stderr
    path.unlink()


def test_an_upgrade_keeps_the_configuration_and_what_was_disabled(machine, next_deb):
    configured = machine.path(CONFIG).read_text()
    machine.do("systemctl", "disable", "mavswitch")
    text = machine.apt_install(next_deb)
    assert NOT_STARTED not in text
    version = machine.do("dpkg-query", "--show", "--showformat", "${Version}", "mavswitch")
    assert version.endswith("-2")
    assert machine.path(CONFIG).read_text() == configured
    assert not machine.path(ENABLED).is_symlink()
    machine.do("systemctl", "enable", "mavswitch")


def test_removed_it_leaves_its_configuration(machine):
    machine.do("apt-get", "remove", "--yes", "mavswitch")
    assert not machine.path("/usr/bin/mavswitch").exists()
    assert machine.path(CONFIG).is_file()


def test_purged_it_leaves_nothing(machine, before):
    # What systemd makes for the unit, and the administrator for the program.
    state = machine.path("/var/lib/private/mavswitch")
    state.mkdir(parents=True)
    machine.path("/var/lib/mavswitch").symlink_to("private/mavswitch")
    machine.path("/etc/mavswitch/conf.d/20-more.toml").write_text("strict = true\n")
    machine.do("apt-get", "purge", "--yes", "mavswitch")
    left = machine.files() - before - {"/var/lib/private"}
    assert not left, sorted(left)
    traces = machine.do("find", "/var/lib", "/etc", "-name", "*mavswitch*")
    assert not traces, traces
