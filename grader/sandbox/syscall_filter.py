"""The kernel calls that a sandbox forbids: those that lead out of it, or to parts of the kernel that no node needs.

That is making a user namespace, in which a process could mount, as root; keyrings, which no namespace separates from
other sandboxes; System V's shared memory and message queues, which stay when a sandbox without namespaces has ended;
sockets to a virtual machine's host or to devices; another process's memory and descriptors; calls known for faults of
the kernel; and the ways to connect by TCP that Landlock does not see (MPTCP, fast open). The filter is a program for
seccomp, in its classic BPF instructions; bubblewrap loads it.
"""

from __future__ import annotations

import errno
import os
import socket
import struct
from collections.abc import Iterable, Mapping

# <linux/audit.h>, <linux/seccomp.h>, <linux/sched.h>, <asm/unistd_64.h>
_X86_64, _X32_CALLS = 0xC000003E, 0x40000000
_ALLOW, _ERRNO = 0x7FFF0000, 0x00050000
_SOCKET, _CLONE, _UNSHARE = 41, 56, 272
_REFUSED = {
    errno.ENOSYS: (  # as by a kernel that was built without them, so that libraries do without them, too
        435,  # clone3: its flags are in memory, out of a filter's sight; the C library then calls clone
        248, 249, 250,  # add_key, request_key, keyctl
        29, 64, 68, 240,  # shmget, semget, msgget, mq_open
        323,  # userfaultfd
        425, 426, 427,  # io_uring_setup, io_uring_enter, io_uring_register
    ),
    errno.EPERM: (101, 310, 311, 438),  # ptrace, process_vm_readv, process_vm_writev, pidfd_getfd
}  # fmt: skip
# execveat, statx, openat2, faccessat2, fchmodat2: proot 5 does not know them and would not translate their paths.
_NOT_BELOW_PROOT = (322, 332, 437, 439, 452)
_FAMILIES = (socket.AF_UNIX, socket.AF_INET, socket.AF_INET6, socket.AF_NETLINK)
_NEW_USER_NAMESPACE = 0x10000000
_LAST_PROTOCOL = 32  # UDP is 17, netlink's go to 22; then come SCTP, MPTCP and SMC, which connect past Landlock
_FAST_OPEN = 0x20000000  # in a flag of these calls, <linux/socket.h>: it connects without connect()
# Offsets in struct seccomp_data.
_NUMBER, _ARCHITECTURE, _FIRST_ARGUMENT, _THIRD_ARGUMENT, _FOURTH_ARGUMENT = 0, 4, 16, 32, 40
_SENDS = {44: _FOURTH_ARGUMENT, 46: _THIRD_ARGUMENT, 307: _FOURTH_ARGUMENT}  # sendto, sendmsg, sendmmsg: their flags
# <linux/bpf_common.h>: load a word; jump if equal, if at least, if a bit is set; return.
_LOAD, _EQUAL, _AT_LEAST, _BIT, _RETURN = 0x20, 0x15, 0x35, 0x45, 0x06


def _program(refused: Mapping[int, Iterable[int]]) -> bytes:
    """Return the filter as the kernel reads it: an array of struct sock_filter."""
    # Each: operation, value, and how many instructions to skip if the comparison holds and if not.
    instructions = (
        (_LOAD, _ARCHITECTURE, 0, 0),
        (_EQUAL, _X86_64, 1, 0),  # 32-bit calls have other numbers; nothing of ROS makes them
        (_RETURN, _ERRNO | errno.ENOSYS, 0, 0),
        (_LOAD, _NUMBER, 0, 0),
        (_AT_LEAST, _X32_CALLS, 0, 1),
        (_RETURN, _ERRNO | errno.ENOSYS, 0, 0),
        *(
            instruction
            for error, calls in refused.items()
            for call in calls
            for instruction in ((_EQUAL, call, 0, 1), (_RETURN, _ERRNO | error, 0, 0))
        ),
        *(
            instruction
            for call, flags in _SENDS.items()
            for instruction in (
                (_EQUAL, call, 0, 4),
                (_LOAD, flags, 0, 0),
                (_BIT, _FAST_OPEN, 0, 1),
                (_RETURN, _ERRNO | errno.EOPNOTSUPP, 0, 0),
                (_RETURN, _ALLOW, 0, 0),
            )
        ),
        (_EQUAL, _SOCKET, 0, 2 * len(_FAMILIES) + 5),
        (_LOAD, _THIRD_ARGUMENT, 0, 0),
        (_AT_LEAST, _LAST_PROTOCOL + 1, 0, 1),
        (_RETURN, _ERRNO | errno.EPROTONOSUPPORT, 0, 0),
        (_LOAD, _FIRST_ARGUMENT, 0, 0),
        *(part for family in _FAMILIES for part in ((_EQUAL, int(family), 0, 1), (_RETURN, _ALLOW, 0, 0))),
        (_RETURN, _ERRNO | errno.EAFNOSUPPORT, 0, 0),
        (_EQUAL, _CLONE, 1, 0),
        (_EQUAL, _UNSHARE, 0, 3),
        (_LOAD, _FIRST_ARGUMENT, 0, 0),
        (_BIT, _NEW_USER_NAMESPACE, 0, 1),
        (_RETURN, _ERRNO | errno.EPERM, 0, 0),
        (_RETURN, _ALLOW, 0, 0),
    )
    return b"".join(struct.pack("=HBBI", code, yes, no, value) for code, value, yes, no in instructions)


PROGRAM_BYTES = _program(_REFUSED)
PROGRAM_BELOW_PROOT = _program(_REFUSED | {errno.ENOSYS: (*_REFUSED[errno.ENOSYS], *_NOT_BELOW_PROOT)})


def open_filter() -> int:
    """Return a new file descriptor from which bubblewrap reads the filter."""
    descriptor = os.memfd_create("seccomp")
    os.write(descriptor, PROGRAM_BYTES)
    os.lseek(descriptor, 0, os.SEEK_SET)
    return descriptor
