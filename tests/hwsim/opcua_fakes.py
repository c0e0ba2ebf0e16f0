"""An axis that keeps what it was told, controllers for it, and a link that can be cut."""

import contextlib
import socket
import threading
from dataclasses import dataclass, field
from typing import ClassVar

import hwsim

ANY = "opc.tcp://127.0.0.1:0"


@dataclass(frozen=True)
class Axis:
    """Moves at the commanded velocity; the part ends after `length` s or with ``stop``."""

    length: float = 0.3
    tick: float = 0.01
    told: list = field(default_factory=list, compare=False)  # (ticks, command) of all parts
    measures: ClassVar = {"place": "mm", "speed": "mm/s"}
    accepts: ClassVar = {"velocity": "mm/s", "stop": ""}
    outcomes: ClassVar = {"place": "mm", "stopped": ""}
    safe: ClassVar = {"velocity": 0.0, "stop": 1.0}
    ranges: ClassVar = {"velocity": (-10.0, 10.0)}

    def start(self, rng):
        return Slide(self)


class Slide:
    def __init__(self, axis):
        self.axis, self.place, self.velocity = axis, 0.0, 0.0
        self.time, self.done, self.event, self.stopped = 0, False, False, False

    def step(self, command, ticks):
        if command:
            self.axis.told.append((self.time, dict(command)))
        self.velocity = command.get("velocity", self.velocity)
        if command.get("stop"):
            self.done = self.stopped = True
        if not self.done:
            most = round(self.axis.length / self.axis.tick) - self.time
            moved = min(ticks, most)
            self.time += moved
            self.place += moved * self.axis.tick * self.velocity
            self.done = moved == most
        return {"place": self.place, "speed": self.velocity}

    def outcome(self):
        return {"place": self.place, "stopped": float(self.stopped)}


class Drive:
    """Commands a velocity each period; in step `at` it does something else."""

    reads: ClassVar = {"place": "mm"}
    commands: ClassVar = {"velocity": "mm/s"}

    def __init__(self, odd=None, at=5, period=0.02):
        self.odd, self.at, self.period = odd, at, period

    def reset(self):
        self.steps = 0

    def step(self, *, place, **others):
        self.steps += 1
        if self.odd is not None and self.steps == self.at:
            return self.odd()
        return {"velocity": 1.0 + 0.001 * self.steps}


def live(**options):
    return hwsim.Live(**{"safe": {"velocity": 0.0, "stop": 1.0}, "deadline": 0.1, **options})


def served(plant, **options):
    return hwsim.serve(plant, ANY, **{"speed": 1.0, "security": "none", **options})


class Cable:
    """Forwards a port to another one until it is cut; what ends at one side ends at the other."""

    def __init__(self, port):
        self._to, self._open = port, []
        self._joining = threading.Lock()  # a connection is cut whole, or made after the cut
        self._flows = threading.Event()
        self._flows.set()
        self.resets = 0  # connections of clients that ended by a reset: what was not sent is dropped
        self._door = socket.create_server(("127.0.0.1", 0))
        self.url = f"opc.tcp://127.0.0.1:{self._door.getsockname()[1]}"
        self._porter = threading.Thread(target=self._accept, daemon=True)
        self._porter.start()

    def _accept(self):
        while True:
            try:
                near, _ = self._door.accept()
            except OSError:
                return
            with self._joining:
                try:
                    far = socket.create_connection(("127.0.0.1", self._to))
                except OSError:  # nobody listens
                    near.close()
                    continue
                for end in (near, far):  # a cable holds nothing back: Nagle's rule may, for 40 ms
                    end.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
                self._open += [near, far]
            threading.Thread(target=self._join, args=(near, far), daemon=True).start()

    def _join(self, near, far):
        """Forward both ways until one side ends; sockets are closed when nobody waits at them any more.

        `close` does not end a connection at which another thread waits, and frees its number for the next one.
        """
        back = threading.Thread(target=self._copy, args=(far, near), daemon=True)
        back.start()
        self._copy(near, far)
        back.join()
        near.close()
        far.close()

    def _copy(self, one, two):
        reset = False
        try:
            while data := one.recv(65536):
                self._flows.wait()
                two.sendall(data)
        except OSError as error:
            reset = isinstance(error, ConnectionResetError)
        end(one, two)
        self.resets += reset

    def stall(self):
        """Hold back all that comes from now on."""
        self._flows.clear()

    def flow(self):
        """Deliver what was held back, and what comes."""
        self._flows.set()

    def cut(self):
        """Break the connections; new ones are possible."""
        with self._joining:
            broken, self._open = self._open, []
        end(*broken)

    def close(self):
        end(self._door)  # wakes who waits there, which `close` does not
        self._porter.join()
        self._door.close()
        self.cut()


def end(*sockets):
    """End connections, at both ends of each."""
    for each in sockets:
        with contextlib.suppress(OSError):  # it has ended
            each.shutdown(socket.SHUT_RDWR)
