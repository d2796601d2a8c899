"""The stage of a test: the router's process, other programs, the peers, and one way to wait.

Owns processes and waiting. Everything that can bring news (a program's output, a peer's socket) is
watched by one `select`, so nothing sleeps: what is waited for is seen when it happens, and a
deadline only ends what is broken.
"""

import os
import re
import select
import signal
import subprocess
import time

# A busy machine is slow, a broken router is silent: long enough to tell one from the other.
PATIENCE = 60.0

# Endpoints at which the router calls, so that the peer has to listen before it starts.
CALLING = ("udpout", "tcpout")


class Program:
    """A process whose output is taken line by line as it comes."""

    def __init__(self, command, **popen):
        self.command = [str(word) for word in command]
        self.lines = []
        self.ended = False
        self._rest = b""
        self.process = subprocess.Popen(
            self.command,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            **{"stdin": subprocess.DEVNULL, **popen},
        )
        os.set_blocking(self.fileno(), False)

    def fileno(self):
        return self.process.stdout.fileno()

    def take(self):
        """Reads what has been printed since."""
        while not self.ended:
            try:
                data = os.read(self.fileno(), 65536)
            except BlockingIOError:
                return
            self.ended = not data
            *lines, self._rest = (self._rest + data).split(b"\n")
            self.lines += [line.decode(errors="replace").rstrip("\r") for line in lines]

    def type(self, line):
        """Types a line, if its standard input is a pipe."""
        self.process.stdin.write(f"{line}\n".encode())
        self.process.stdin.flush()

    def says(self, pattern):
        """The match of a regular expression in the first line that has one, or None."""
        matches = (re.search(pattern, line) for line in self.lines)
        return next((match for match in matches if match), None)

    def stop(self, how=signal.SIGTERM):
        """Asks it to end, and returns its exit status."""
        self.process.send_signal(how)
        try:
            return self.process.wait(PATIENCE)
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.wait()
            raise
        finally:
            self.take()
            self.process.stdout.close()

    def __str__(self):
        return "\n  ".join([f"output of {' '.join(self.command)}:", *self.lines[-40:]])


class Stage:
    """One router and everybody who talks through it."""

    def __init__(self, binary):
        self.binary = binary
        self.router = None
        self.programs = []
        self.peers = []
        # Peer -> the endpoint it is to be found at.
        self._endpoints = {}
        # Listeners that are no peers, only hear.
        self.listeners = []
        self._round = 0

    def start(self, command, **popen):
        """Starts a program that is ended with the stage."""
        program = Program(command, **popen)
        self.programs.append(program)
        return program

    def start_router(self, *arguments):
        """Starts the router and waits until all its endpoints are open."""
        self.router = self.start([self.binary, *arguments])
        self.until("the router to be ready", lambda: self.router.says(r"\bready$"))
        return self.router

    def port(self, endpoint):
        """The port at which an endpoint of the router listens, by the endpoint's name."""
        pattern = rf"\b{re.escape(endpoint)}: listening on \S+:(\d+)$"
        return int(self.router.says(pattern)[1])

    def peer(self, peer, endpoint):
        """Gives a peer an endpoint of its own."""
        if endpoint in CALLING:
            peer.listen(endpoint)
        self._endpoints[peer] = (endpoint, peer.name)
        self.peers.append(peer)
        return peer

    def peer_beside(self, other, peer):
        """Gives a peer a place at the endpoint of another one, which the router listens at."""
        self._endpoints[peer] = self._endpoints[other]
        self.peers.append(peer)
        return peer

    def open(self, *arguments):
        """Starts the router, and everybody joins: seen by the router, and heard by the others."""
        addresses = dict.fromkeys(
            f"{kind}:127.0.0.1:{peer.port if kind in CALLING else 0}?name={name}"
            for peer, (kind, name) in self._endpoints.items()
        )
        self.start_router(*arguments, *addresses)
        for peer, (kind, name) in self._endpoints.items():
            if kind not in CALLING:
                peer.connect(kind, self.port(name))
        silent = list(self.peers)

        def all_are_seen():
            # Who listens by UDP can only answer: it has to hear somebody first.
            for peer in [peer for peer in silent if peer.can_speak()]:
                peer.greet()
                silent.remove(peer)
            return all(map(self.has_seen, self.peers))

        self.until("everybody to be seen by the router", all_are_seen)
        self.roll_call()
        for peer in self.peers:
            peer.forget()

    def has_seen(self, peer):
        """Whether the router has told that it knows where a peer is."""
        return self.router.says(rf"component {peer.system}/{peer.component} seen on")

    def roll_call(self):
        """Everybody says one more heartbeat, and everybody hears all of them.

        What was said before has then been heard too, or never will be: the router keeps the order.
        """
        self._round += 1
        for peer in self.peers:
            peer.greet(self._round)
        others = [(a, b) for a in self.peers for b in self.peers if a is not b]
        self.until(
            "everybody to hear everybody",
            lambda: all(a.has_heard_greeting(b, self._round) for a, b in others),
        )

    def until(self, what, is_true):
        """Lets everybody listen and answer until something is true."""
        deadline = time.monotonic() + PATIENCE
        while not is_true():
            left = deadline - time.monotonic()
            if left <= 0:
                raise AssertionError(f"waited {PATIENCE:.0f} s for {what}\n{self}")
            if self.router and self.router.ended:
                raise AssertionError(f"the router ended while waiting for {what}\n{self}")
            self._listen(left)

    def _listen(self, patience):
        """Waits for news, and lets those take it whom it concerns."""
        everybody = [*self.programs, *self.listeners, *(p for p in self.peers if p.link)]
        awake = [somebody for somebody in everybody if not getattr(somebody, "ended", False)]
        beats = [peer.next_heartbeat for peer in self.peers if peer.next_heartbeat is not None]
        patience = min([patience, *(max(0.0, beat - time.monotonic()) for beat in beats)])
        ready, _, _ = select.select(awake, [], [], patience)
        for somebody in ready:
            somebody.take()
        for peer in self.peers:
            peer.keep_beating()

    def close(self):
        """Ends everything; the router has to end in good order."""
        for peer in [peer for peer in self.peers if peer.link]:
            peer.link.close()
        for listener in self.listeners:
            listener.socket.close()
        for program in [program for program in self.programs if program is not self.router]:
            program.stop(signal.SIGKILL)
        status = self.router.stop() if self.router else 0
        print(self)
        assert status == 0, f"the router ended with status {status}"

    def __str__(self):
        return "\n".join(
            str(somebody) for somebody in [*self.peers, *self.listeners, *self.programs]
        )
