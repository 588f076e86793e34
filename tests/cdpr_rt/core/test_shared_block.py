"""The shared memory of the daemon's processes is sealed and validated."""

from __future__ import annotations

import os
import platform

import pytest

from cdpr_rt.core.shared_block import SharedBlock, SharedBlockError


@pytest.mark.parametrize("by", [-4096, 4096])
def test_the_block_cannot_be_resized(by: int) -> None:
    block = SharedBlock.create(3, 1.0, 100.0)
    size = os.fstat(block.fd).st_size
    with pytest.raises(PermissionError):
        os.ftruncate(block.fd, size + by)
    joined = SharedBlock.attach(block.fd)
    assert (joined.n, joined.capacity) == (3, block.capacity)


def test_resizable_memory_is_rejected() -> None:
    made = SharedBlock.create(1, 1.0, 100.0)
    fd = os.memfd_create("open", os.MFD_ALLOW_SEALING)
    os.write(fd, os.pread(made.fd, os.fstat(made.fd).st_size, 0))
    with pytest.raises(SharedBlockError, match="resized"):
        SharedBlock.attach(fd)


def test_a_read_only_descriptor_cannot_write() -> None:
    made = SharedBlock.create(2, 1.0, 100.0)
    made.write_status({"state": "ready"})
    fd = os.open(f"/proc/self/fd/{made.fd}", os.O_RDONLY)
    onlooker = SharedBlock.attach(fd)
    assert onlooker.status() == {"state": "ready"}
    for write in (
        lambda: onlooker.post_command({"do": "enable"}),
        lambda: onlooker.write_status({"state": "active"}),
        lambda: onlooker.counters.__setitem__("right_until_ns", 1),
        lambda: onlooker.rows.__setitem__(0, onlooker.rows[1]),
    ):
        with pytest.raises(ValueError, match="read-only"):
            write()
    assert made.status() == {"state": "ready"}
    os.close(fd)


@pytest.mark.parametrize(("counter", "value"), [("axes", 0), ("axes", 2), ("capacity", 1 << 40)])
def test_memory_whose_size_contradicts_its_header_is_rejected(counter: str, value: int) -> None:
    block = SharedBlock.create(1, 1.0, 100.0)
    block.counters[counter] = value
    with pytest.raises(SharedBlockError, match="bytes"):
        SharedBlock.attach(block.fd)


def test_a_processor_with_weak_memory_order_is_rejected(monkeypatch: pytest.MonkeyPatch) -> None:
    made = SharedBlock.create(1, 1.0, 100.0)  # harmless within one process
    monkeypatch.setattr(platform, "machine", lambda: "aarch64")
    with pytest.raises(SharedBlockError, match="processor is aarch64"):
        SharedBlock.attach(made.fd)
