"""Commands in processes of their own, forked from one that has imported them: a second less for each."""

import os
import resource
import signal
import subprocess
import sys
from multiprocessing import get_context

from hwsim.cli import main

IMPORTED = (
    "dask.array",
    "hwsim._loop.loop",
    "hwsim.cli",
    "hwsim.command._locus.toml",
    "hwsim.command._plunge.toml",
    "hwsim.command._report",
    "hwsim.command._weldbead.toml",
    "numba.np.arrayobj",
    "numba.np.npyimpl",
    "scipy.stats",
)
"""What the commands of these tests import once they know what they are asked for."""


def forked():
    """Context of processes that are forked from one that has imported all that."""
    context = get_context("forkserver")
    context.set_forkserver_preload(list(IMPORTED))
    return context


class Command:
    """``hwsim`` with these arguments, as `subprocess.Popen` with pipes for both outputs.

    Parameters
    ----------
    *arguments : str
        Of the command.
    full_disk : bool
        Whether no file can grow beyond 4 KiB.
    unread : bool
        Whether standard error has lost its reader before the command begins.
    closed : bool
        Whether standard error is closed, which Python shows as None.
    """

    def __init__(self, *arguments, full_disk=False, unread=False, closed=False):
        context = forked()
        (out, its_out), (error, its_error) = (context.Pipe(duplex=False) for _ in range(2))
        self.stdout, self.stderr = (os.fdopen(os.dup(end.fileno()), "r") for end in (out, error))
        out.close()
        error.close()
        if unread:
            self.stderr.close()
        given = its_out, its_error, [str(each) for each in arguments], full_disk, closed
        self._process = context.Process(target=_carry_out, args=given, daemon=True)
        self._process.start()
        its_out.close()
        its_error.close()

    def __enter__(self):
        return self

    def __exit__(self, *error):
        self.stdout.close()
        self.stderr.close()
        self.wait()

    @property
    def returncode(self):
        return self._process.exitcode

    def poll(self):
        return self._process.exitcode

    def wait(self, timeout=100.0):
        """Wait, at most `timeout` seconds."""
        self._process.join(timeout)
        if self.returncode is None:
            raise subprocess.TimeoutExpired("hwsim", timeout)

    def send_signal(self, number):
        os.kill(self._process.pid, number)

    def kill(self):
        self._process.kill()

    def communicate(self):
        """Both outputs, and wait for the end; the second fits into its pipe."""
        with self:
            return tuple("" if end.closed else end.read() for end in (self.stdout, self.stderr))


def _carry_out(out, error, arguments, full_disk, closed):
    """What the new process does."""
    for number, end in enumerate((out, error), 1):
        os.dup2(end.fileno(), number)
        end.close()
    if closed:
        os.close(2)
        sys.stderr = None
    sys.argv = ["hwsim", *arguments]
    if full_disk:
        # Without bytecode: Python 3.11 would leave that of a new module cut at the limit, for all later processes.
        sys.dont_write_bytecode = True
        signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
        resource.setrlimit(resource.RLIMIT_FSIZE, (4096, 4096))
    sys.exit(main())
