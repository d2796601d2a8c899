"""The service on a bare Debian whose systemd runs: from `apt install` to `apt purge`.

The tests share one computer and go on where the one before has ended, so they run as they stand.
"""

import json
import time

import pytest
from machine import PATIENCE

CONFIG = "/etc/mavswitch/mavswitch.toml"


@pytest.fixture(scope="module", autouse=True)
def possible(computer):
    """Where a user namespace cannot be had, the unit has to do without its own."""
    trial = computer.run("systemd-run", "--quiet", "--wait", "-pPrivateUsers=yes", "/bin/true")
    if trial.returncode != 0:
        folder = "/run/systemd/system/mavswitch.service.d"
        script = f'mkdir -p {folder} && printf "[Service]\\nPrivateUsers=no\\n" > {folder}/here.conf'
        computer.do("sh", "-c", script)


def show(computer, name):
    """A property of the service."""
    return computer.do("systemctl", "show", "--property", name, "--value", "mavswitch").strip()


def log(computer):
    """What the journal has of the service: priority and text of each line."""
    computer.do("journalctl", "--sync")
    lines = computer.do("journalctl", "--unit=mavswitch", "--output=json").splitlines()
    entries = [json.loads(line) for line in lines if line.startswith("{")]
    return [(int(entry["PRIORITY"]), entry["MESSAGE"]) for entry in entries]


def wait_for(what, condition):
    deadline = time.monotonic() + PATIENCE
    while not condition():
        assert time.monotonic() < deadline, f"waited in vain for {what}"
        time.sleep(0.1)


def edit(computer, script):
    computer.do("sed", "-i", script, CONFIG)


def test_as_installed_it_is_enabled_and_was_skipped_and_says_why(computer, deb):
    computer.apt_install(deb)
    assert show(computer, "UnitFileState") == "enabled"
    assert (show(computer, "ActiveState"), show(computer, "Result")) == ("inactive", "exec-condition")
    assert "mavswitch" not in computer.do("systemctl", "--failed")
    [(priority, text)] = [entry for entry in log(computer) if "no endpoint is configured" in entry[1]]
    assert priority == 4 and text.startswith("not started: ")


def test_two_lines_edited_it_starts(computer):
    edit(computer, r"s/^#\(endpoint\.\)/\1/")
    computer.do("systemctl", "start", "mavswitch")
    assert show(computer, "ActiveState") == "active"
    assert show(computer, "StatusText") == "0 links, 0 components; waiting for fc"
    entries = log(computer)
    assert (6, "ready") in entries
    [priority] = [priority for priority, text in entries if "/dev/ttyACM0: No such file" in text]
    assert priority == 4


def test_it_runs_as_a_user_of_its_own_who_may_open_serial_ports(computer):
    process = show(computer, "MainPID")
    assert "mavswitch\n" in computer.do("sh", "-c", "cat /proc/[0-9]*/comm")
    status = computer.do("cat", f"/proc/{process}/status")
    fields = dict(line.split(":", 1) for line in status.splitlines())
    assert "0" not in fields["Uid"].split()
    dialout = computer.do("getent", "group", "dialout").split(":")[2]
    assert dialout in fields["Groups"].split()
    assert fields["NoNewPrivs"].strip() == "1" and int(fields["CapBnd"], 16) == 0


def test_a_reload_is_told_and_keeps_the_process(computer):
    process = show(computer, "MainPID")
    edit(computer, "$a[endpoint.sim]\\naddress = 'tcpin:0.0.0.0:0'")
    computer.do("systemctl", "reload", "mavswitch")
    wait_for("the new endpoint", lambda: any("sim: listening" in text for _, text in log(computer)))
    assert show(computer, "MainPID") == process
    wait_for("the end of the reload", lambda: show(computer, "ActiveState") == "active")


def test_a_wrong_file_makes_a_reload_fail_and_changes_nothing(computer):
    process = show(computer, "MainPID")
    edit(computer, "s/^endpoint.gcs.address/endpoint.gcs.addres/")
    assert computer.run("systemctl", "reload", "mavswitch").returncode != 0
    assert show(computer, "ActiveState") == "active"
    wait_for("the reason", lambda: any(it[0] == 3 and "`addres`" in it[1] for it in log(computer)))
    asked = computer.run("mavswitch", "reload")
    assert asked.returncode == 2 and "`addres`" in asked.stderr, asked.stderr
    edit(computer, "s/^endpoint.gcs.addres /endpoint.gcs.address /")
    computer.do("systemctl", "reload", "mavswitch")
    assert show(computer, "MainPID") == process


def test_one_that_stands_still_is_started_again(computer):
    process = show(computer, "MainPID")
    computer.do("sh", "-c", f"kill -STOP {process}")
    is_new = lambda: show(computer, "MainPID") not in (process, "0")  # noqa: E731
    wait_for("another process", is_new)
    wait_for("its start", lambda: show(computer, "ActiveState") == "active")
    assert int(show(computer, "NRestarts")) >= 1


def test_a_wrong_file_is_a_failure_that_is_told_and_not_tried_again(computer):
    edit(computer, "s/^endpoint.fc.address/endpoint.fc.adress/")
    assert computer.run("systemctl", "restart", "mavswitch").returncode != 0
    assert (show(computer, "ActiveState"), show(computer, "ExecMainStatus")) == ("failed", "2")
    told = [priority for priority, text in log(computer) if "`adress`" in text]
    assert told == [3], log(computer)[-5:]
    edit(computer, "s/^endpoint.fc.adress/endpoint.fc.address/")
    computer.do("systemctl", "start", "mavswitch")


def test_an_upgrade_starts_the_new_one(computer, next_deb):
    process = show(computer, "MainPID")
    computer.apt_install(next_deb)
    assert show(computer, "ActiveState") == "active"
    assert show(computer, "MainPID") != process


def test_purged_nothing_is_left_and_nothing_runs(computer):
    computer.do("apt-get", "purge", "--yes", "mavswitch")
    assert show(computer, "LoadState") == "not-found"
    assert "mavswitch\n" not in computer.do("sh", "-c", "cat /proc/[0-9]*/comm")
    left = computer.do("find", "/etc", "/usr", "/var", "-name", "*mavswitch*")
    assert not left, left
