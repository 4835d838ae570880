"""Read a compressed file as the stream that it unpacks to, up to a limit."""

from __future__ import annotations

import bz2
import lzma
import zlib
from collections.abc import Callable
from typing import IO, Any, Protocol

# An xz file declares its dictionary size, up to 4 GiB; `xz -9` needs 65 MiB.
MAX_LZMA_MEMORY = 256 * 1024**2


class Readable(Protocol):
    """A stream of bytes."""

    def read(self, size: int = -1, /) -> bytes:
        """Return at most `size` bytes; b"" at the end."""


class StreamTooLong(Exception):
    """A stream is longer than its limit."""


class CappedStream:
    """A stream that raises StreamTooLong instead of reading more than `max_bytes`."""

    def __init__(self, stream: Readable, max_bytes: int) -> None:
        self._stream = stream
        self._left = max_bytes

    def read(self, size: int = -1) -> bytes:
        """Return at most `size` bytes, which have to be said."""
        if size < 0 or size > self._left:
            raise StreamTooLong
        data = self._stream.read(size)
        self._left -= len(data)
        return data


class _PackedStream:
    """What a compressed file unpacks to. Several streams in one file are read as one, as gzip, bzip2 and xz do."""

    def __init__(self, file: IO[bytes], new: Callable[[], Any], magic: bytes) -> None:
        self._file = file
        self._new = new
        self._magic = magic
        self._decompressor = new()
        self._packed = b""

    def read(self, size: int = -1) -> bytes:
        while not self._decompressor.eof or self._begin_next():
            # zlib hands back what it has not used yet; the others keep it, and say when they need more.
            hungry = not self._packed and getattr(self._decompressor, "needs_input", True)
            packed = self._file.read(64 * 1024) if hungry else self._packed
            if hungry and not packed:
                raise EOFError("the packed stream ends early")
            data: bytes = self._decompressor.decompress(packed, size)
            self._packed = getattr(self._decompressor, "unconsumed_tail", b"")
            if data:
                return data
        return b""

    def _begin_next(self) -> bool:
        """Begin with the stream that follows; False if there is none. Zero bytes between streams are padding."""
        rest = self._decompressor.unused_data.lstrip(b"\0")
        while len(rest) < len(self._magic) and (block := self._file.read(64 * 1024)):
            rest = (rest + block).lstrip(b"\0")
        if not rest:
            return False
        if not rest.startswith(self._magic):
            raise FollowedByMore
        self._decompressor, self._packed = self._new(), rest
        return True


class FollowedByMore(Exception):
    """A compressed stream is followed by something that is not such a stream."""


_PACKED: dict[bytes, Callable[[], Any]] = {
    b"\x1f\x8b": lambda: zlib.decompressobj(wbits=31),
    b"BZh": bz2.BZ2Decompressor,
    b"\xfd7zXZ\x00": lambda: lzma.LZMADecompressor(memlimit=MAX_LZMA_MEMORY),
}
"""The compressions that a tar may have, by the first bytes of the file."""


def unpacker(head: bytes) -> Callable[[IO[bytes]], Readable] | None:
    """Return the function that decompresses a tar that starts with `head`; None if it is not a tar."""
    for magic, new in _PACKED.items():
        if head.startswith(magic):
            return lambda file: _PackedStream(file, new, magic)
    if head[257:262] == b"ustar":
        return lambda file: file
    return None
