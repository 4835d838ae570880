"""The kernel calls that a sandbox forbids: those that make a user namespace, in which a process has root's powers.

With them it could mount, and reach parts of the kernel that no ordinary user does. The filter is a program for the
kernel's seccomp, in its classic BPF instructions; bubblewrap loads it.
"""

from __future__ import annotations

import errno
import os
import struct

# <linux/audit.h>, <linux/seccomp.h>, <linux/sched.h>, <asm/unistd_64.h>
_X86_64, _X32_CALLS = 0xC000003E, 0x40000000
_ALLOW, _ERRNO = 0x7FFF0000, 0x00050000
_CLONE, _UNSHARE, _CLONE3 = 56, 272, 435
_NEW_USER_NAMESPACE = 0x10000000
# Offsets in struct seccomp_data.
_NUMBER, _ARCHITECTURE, _FIRST_ARGUMENT = 0, 4, 16
# <linux/bpf_common.h>: load a word; jump if equal, if at least, if a bit is set; return.
_LOAD, _EQUAL, _AT_LEAST, _BIT, _RETURN = 0x20, 0x15, 0x35, 0x45, 0x06

# Each: operation, value, and how many instructions to skip if the comparison holds and if not.
_PROGRAM = (
    (_LOAD, _ARCHITECTURE, 0, 0),
    (_EQUAL, _X86_64, 0, 8),  # 32-bit calls have other numbers; nothing of ROS makes them
    (_LOAD, _NUMBER, 0, 0),
    (_AT_LEAST, _X32_CALLS, 6, 0),
    (_EQUAL, _CLONE3, 5, 0),  # its flags are in memory, out of a filter's sight; the C library then calls clone
    (_EQUAL, _CLONE, 1, 0),
    (_EQUAL, _UNSHARE, 0, 4),
    (_LOAD, _FIRST_ARGUMENT, 0, 0),
    (_BIT, _NEW_USER_NAMESPACE, 0, 2),
    (_RETURN, _ERRNO | errno.EPERM, 0, 0),
    (_RETURN, _ERRNO | errno.ENOSYS, 0, 0),
    (_RETURN, _ALLOW, 0, 0),
)


PROGRAM_BYTES = b"".join(struct.pack("=HBBI", code, yes, no, value) for code, value, yes, no in _PROGRAM)
"""The filter as the kernel reads it: an array of struct sock_filter."""


def open_filter() -> int:
    """Return a new file descriptor from which bubblewrap reads the filter."""
    descriptor = os.memfd_create("seccomp")
    os.write(descriptor, PROGRAM_BYTES)
    os.lseek(descriptor, 0, os.SEEK_SET)
    return descriptor
