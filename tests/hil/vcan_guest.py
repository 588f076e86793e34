"""Real SocketCAN buses `vcan0` and `vcan1`, of the machine or of a guest kernel.

The guest is Debian's user-mode-linux, a normal process with the machine's files as its root. It
runs the same tree and environment. Its packages are downloaded and unpacked into a cache, and not
installed.
"""

import contextlib
import os
import shlex
import shutil
import signal
import socket
import subprocess
import tempfile
from dataclasses import dataclass
from pathlib import Path

INTERFACES = ("vcan0", "vcan1")
PACKAGES = ("user-mode-linux", "busybox-static")
MEMORY_MB = 2048
DOWNLOAD_TIMEOUT_S = 240
RUN_TIMEOUT_S = 1200
_CONSOLE_TAIL_LINES = 30


class NoGuestError(Exception):
    """The guest is not available or does not start on this machine. The text gives the reason."""


@dataclass(frozen=True)
class Guest:
    """The paths of the guest's parts."""

    kernel: Path
    modules: Path
    busybox: Path


@dataclass(frozen=True)
class GuestRun:
    """The result of a run: exit code of the command (None if it did not end) and output."""

    exit_code: int | None
    output: str


def own_vcan() -> bool:
    """Return whether this machine has both buses. As root, add missing ones."""
    if not hasattr(socket, "AF_CAN"):
        return False
    ip = shutil.which("ip", path=f"{os.environ.get('PATH', '')}:/usr/sbin:/sbin")
    for name in INTERFACES:
        if os.geteuid() == 0 and ip and not _is_up(name):
            for words in (("add", name, "type", "vcan"), ("set", name, "up")):
                subprocess.run([ip, "link", *words], check=False, capture_output=True)
    return all(map(_is_up, INTERFACES))


def _is_up(name: str) -> bool:
    try:
        flags = Path(f"/sys/class/net/{name}/flags").read_text(encoding="ascii")
        socket.socket(socket.AF_CAN, socket.SOCK_RAW, socket.CAN_RAW).close()
    except OSError:
        return False
    return bool(int(flags, 16) & 1)


def obtain(cache: Path) -> Guest:
    """Return the guest's parts from `cache`, fetched by apt if missing, or raise NoGuestError."""
    guest = _unpacked(cache)
    if guest is not None:
        return guest
    for tool in ("apt-get", "dpkg"):
        if shutil.which(tool) is None:
            raise NoGuestError(f"no {tool} here to fetch {' and '.join(PACKAGES)} with")
    cache.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(prefix="vcan-guest-", dir=cache.parent) as scratch:
        fresh = Path(scratch) / "unpacked"
        for package in _download(Path(scratch)):
            _run(["dpkg", "-x", str(package), str(fresh)], Path(scratch))
        if _unpacked(fresh) is None:
            raise NoGuestError(f"{' and '.join(PACKAGES)} hold no kernel for this machine")
        with contextlib.suppress(OSError):  # another run was faster
            fresh.rename(cache)
    guest = _unpacked(cache)
    if guest is None:
        raise NoGuestError(f"{cache} is in the way; remove it")
    return guest


def _unpacked(folder: Path) -> Guest | None:
    kernel, busybox = folder / "usr/bin/linux.uml", folder / "bin/busybox"
    modules = sorted((folder / "usr/lib/uml/modules").glob("*/"))
    if kernel.is_file() and busybox.is_file() and modules:
        return Guest(kernel, modules[-1], busybox)
    return None


def _download(folder: Path) -> list[Path]:
    """Fetch the packages, with separate package lists if those of the machine lack them."""
    get = ["apt-get", "-q", "-o", "Acquire::Retries=2", "-o", "Acquire::http::Timeout=30"]
    try:
        _run([*get, "download", *PACKAGES], folder)
    except NoGuestError:
        for name in ("lists/partial", "cache/archives/partial"):
            (folder / name).mkdir(parents=True)
        own = ["-o", f"Dir::State::Lists={folder}/lists", "-o", f"Dir::Cache={folder}/cache"]
        _run([*get, *own, "update"], folder)
        _run([*get, *own, "download", *PACKAGES], folder)
    return sorted(folder.glob("*.deb"))


def _run(command: list[str], folder: Path) -> None:
    try:
        subprocess.run(
            command,
            cwd=folder,
            check=True,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            timeout=DOWNLOAD_TIMEOUT_S,
        )
    except subprocess.CalledProcessError as error:
        last = (error.stdout.strip().splitlines() or ["no output"])[-1]
        raise NoGuestError(f"{shlex.join(command[:1])} failed: {last}") from None
    except (OSError, subprocess.TimeoutExpired) as error:
        raise NoGuestError(f"{command[0]}: {error}") from None


def run(
    guest: Guest,
    command: list[str],
    cwd: Path,
    environment: dict[str, str],
    run_dir: Path,
    timeout_s: float = RUN_TIMEOUT_S,
) -> GuestRun:
    """Boot the guest, run `command` in it, and wait until it is off.

    `run_dir` is an empty folder whose path has no blanks. The guest may write only there. Raise
    NoGuestError if the guest did not reach the command.
    """
    exports = "".join(f"export {k}={shlex.quote(v)}\n" for k, v in environment.items())
    (run_dir / "command.sh").write_text(
        f"{exports}cd {shlex.quote(str(cwd))} && exec {shlex.join(command)}\n"
    )
    shutil.copy(Path(__file__).parent / "guest_init.sh", run_dir / "init.sh")
    shutil.copy(guest.busybox, run_dir / "busybox")
    (run_dir / "modules").symlink_to(guest.modules.resolve())
    console = run_dir / "console.txt"
    problem = _boot(guest, run_dir, console, timeout_s)
    if not (run_dir / "ready").exists():
        tail = console.read_text(errors="replace").strip().splitlines()[-3:]
        raise NoGuestError(f"the guest kernel did not start{problem}: {' / '.join(tail)}")
    output = "".join(
        path.read_text(errors="replace")
        for path in (run_dir / "output.txt", console)
        if path.exists()
    )
    tail = "\n".join(output.splitlines()[-_CONSOLE_TAIL_LINES:])
    code = run_dir / "exit_code"
    return GuestRun(int(code.read_text()) if code.exists() else None, f"{tail}{problem}")


def _has_amx() -> bool:
    return "amx_tile" in Path("/proc/cpuinfo").read_text().split()


def whole_xstate(folder: Path) -> Path:
    """Compile the library without which the guest's kernel panics on processors with AMX."""
    library = folder / "whole_xstate.so"
    source = Path(__file__).parent / "whole_xstate.c"
    _run(["cc", "-shared", "-fPIC", "-O2", "-o", str(library), str(source), "-ldl"], folder)
    return library


def _boot(guest: Guest, run_dir: Path, console: Path, timeout_s: float) -> str:
    """Run the guest kernel to its end. Return the error as text, "" if there was none."""
    words = [
        *(f"mem={MEMORY_MB}M", "root=/dev/root", "rootfstype=hostfs", "rootflags=/", "ro", "quiet"),
        *(f"init={run_dir}/init.sh", f"RUN_DIR={run_dir}"),
        *("con=null", "con0=fd:0,fd:1", "ssl=null"),
    ]
    # Its memory is a file in TMPDIR, which is /dev/shm if there is room.
    shm = Path("/dev/shm")
    roomy = shm.is_dir() and shutil.disk_usage(shm).free > MEMORY_MB << 20
    environment = {
        "PATH": os.environ.get("PATH", os.defpath),
        "HOME": str(run_dir),
        "TMPDIR": str(shm if roomy else run_dir),
    }
    if _has_amx():
        environment["LD_PRELOAD"] = str(whole_xstate(run_dir))
    with console.open("wb") as out:
        try:
            process = subprocess.Popen(
                # timeout ends the guest even if this process is killed first.
                ["timeout", "-k", "5", str(timeout_s + 30), str(guest.kernel), *words],
                stdin=subprocess.DEVNULL,
                stdout=out,
                stderr=subprocess.STDOUT,
                env=environment,
                start_new_session=True,
            )
        except OSError as error:
            return f" ({error})"
        try:
            process.wait(timeout_s)
        except subprocess.TimeoutExpired:
            return f" (stopped after {timeout_s:.0f} s)"
        finally:
            # The guest's processes are also processes of this machine, in a separate group.
            with contextlib.suppress(ProcessLookupError):
                os.killpg(process.pid, signal.SIGKILL)
            process.wait()
    return ""
