"""A bare Debian in a directory, and the service manager that its program speaks to.

Owns the root file system and the processes in it. Nothing in it reaches the network of the machine
that runs the tests. It may be booted, in namespaces of its own; else systemd does not run there, and
what it would do is done by hand.
"""

import os
import re
import shlex
import shutil
import signal
import socket
import subprocess
import time
from pathlib import Path

# A busy machine is slow, a broken program is silent: long enough to tell one from the other.
PATIENCE = 60.0

PATH = {"PATH": "/usr/sbin:/usr/bin:/sbin:/bin"}

# Namespaces of its own, which end with it.
ALONE = ["unshare", "--mount", "--pid", "--net", "--ipc", "--uts", "--fork", "--kill-child"]

# What a boot needs in the root $0, as a container has it.
BOOT = """
set -e
mount --make-rprivate /
mount --bind "$0" "$0"
mount -t proc proc "$0/proc"
mount --rbind /sys "$0/sys"
for at in run tmp dev; do mount -t tmpfs tmpfs "$0/$at"; done
for name in null zero full random urandom tty; do
    touch "$0/dev/$name"
    mount --bind "/dev/$name" "$0/dev/$name"
done
exec env -i container=test PATH="$PATH" chroot "$0" /lib/systemd/systemd --log-target=null
"""

UNIT = "/usr/lib/systemd/system/mavswitch.service"

# What every installation of a package leaves behind, whatever the package.
TRACES = re.compile(r"/(var/(lib/(dpkg|apt|systemd)|log|cache)|proc|sys|dev|tmp|run)(/|$)")


class Machine:
    """Debian 12 with what is essential, apt and systemd."""

    def __init__(self, root):
        self.root = Path(root)
        self.init = None

    @classmethod
    def install(cls, root):
        """Makes it, from where this machine has its own packages."""
        command = ["apt-get", "indextargets", "--format", "$(SITE)", "Codename: bookworm"]
        site = subprocess.run(command, check=True, capture_output=True, text=True).stdout.split()[0]
        command = ["mmdebstrap", "--quiet", "--variant=essential"]
        packages = "--include=apt,systemd,systemd-sysv,dbus"
        subprocess.run([*command, packages, "bookworm", str(root), site], check=True)
        return cls(root)

    def copy(self, root):
        """Another one like it."""
        subprocess.run(["cp", "--archive", str(self.root), str(root)], check=True)
        return Machine(root)

    def boot(self):
        """Starts its systemd, and says whether that came up."""
        command = [*ALONE, "sh", "-c", BOOT, str(self.root)]
        self.init = subprocess.Popen(command, env=PATH, stdin=subprocess.DEVNULL)
        deadline = time.monotonic() + PATIENCE
        while time.monotonic() < deadline and self.init.poll() is None:
            state = self.run("systemctl", "is-system-running").stdout.strip()
            if state in ("running", "degraded"):
                return True
            time.sleep(0.2)
        return False

    def close(self):
        """Ends it, with all that runs in it, and takes its files away."""
        if self.init:
            self.init.kill()
            self.init.wait()
        shutil.rmtree(self.root, ignore_errors=True)

    def path(self, path):
        """Where a file of the machine is, seen from outside."""
        return self.root / path.lstrip("/")

    def run(self, *command):
        """Runs a command in it as root, with no network, and returns how it ended."""
        command = [*self._inside(), "chroot", str(self.root), *map(str, command)]
        environment = {**PATH, "DEBIAN_FRONTEND": "noninteractive"}
        return subprocess.run(
            command, env=environment, capture_output=True, text=True, timeout=10 * PATIENCE
        )

    def _inside(self):
        """What a command is to be run by, to be among its processes."""
        if not self.init:
            return ["unshare", "--net"]
        children = Path(f"/proc/{self.init.pid}/task/{self.init.pid}/children").read_text().split()
        # Not there yet, or gone: then the command fails.
        first = children[0] if children else "0"
        return ["nsenter", "--target", first, "--mount", "--pid", "--net", "--ipc", "--uts"]

    def do(self, *command):
        """The same for what has to succeed, and returns what it printed."""
        done = self.run(*command)
        assert done.returncode == 0, f"{command}: {done.stdout}{done.stderr}"
        return done.stdout + done.stderr

    def apt_install(self, deb):
        """`apt install ./FILE`, and returns what it printed."""
        shutil.copy(deb, self.path("/root"))
        text = self.do("apt-get", "install", "--yes", f"/root/{deb.name}")
        self.path(f"/root/{deb.name}").unlink()
        return text

    def files(self):
        """Every path there is, but for traces that any package leaves."""
        found = set()
        for folder, folders, names in os.walk(self.root):
            inside = "/" + os.path.relpath(folder, self.root)
            found.update(os.path.normpath(f"{inside}/{name}") for name in [*folders, *names])
        return {path for path in found if not TRACES.match(path)}

    def setting(self, name):
        """The value of a setting of the installed unit."""
        lines = self.path(UNIT).read_text().splitlines()
        [value] = [line.partition("=")[2] for line in lines if line.startswith(f"{name}=")]
        return value

    def service(self, **more):
        """Starts the program as the unit would."""
        return Service(self, self.setting("ExecStart"), more)


class Service:
    """The running program, and the manager's end of its notification socket."""

    def __init__(self, machine, command, more):
        self.root = machine.root
        path = machine.path("/run/notify")
        path.unlink(missing_ok=True)
        self.socket = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
        self.socket.bind(str(path))
        self.socket.settimeout(PATIENCE)
        path.chmod(0o777)
        user = ["chroot", "--userspec=nobody:nogroup", "--groups=dialout", str(machine.root)]
        self.process = subprocess.Popen(
            ["unshare", "--net", *user, *shlex.split(command)],
            env={**PATH, "NOTIFY_SOCKET": "/run/notify", **more},
            stdin=subprocess.DEVNULL,
            stderr=subprocess.PIPE,
            text=True,
        )

    def hear(self):
        """The next message to the manager."""
        try:
            return self.socket.recv(4096).decode()
        except TimeoutError:
            raise AssertionError(f"no message; {self.stop()}") from None

    def hear_all_but(self, known, count):
        """The next messages but these, as many as that."""
        heard = []
        while len(heard) < count:
            message = self.hear()
            if message != known:
                heard.append(message)
        return heard

    def reload(self, command):
        """Has it read its configuration anew, with the unit's command."""
        command = ["chroot", str(self.root), *shlex.split(command)]
        environment = {**PATH, "MAINPID": str(self.process.pid)}
        subprocess.run(command, env=environment, check=True, timeout=PATIENCE)

    def stop(self):
        """Asks it to end, and returns its exit status and its log."""
        self.process.send_signal(signal.SIGTERM)
        _, log = self.process.communicate(timeout=PATIENCE)
        return self.process.returncode, log

    def close(self):
        self.process.kill()
        self.process.communicate()
        self.socket.close()
