"""The first process below proot in a sandbox of user_start: runs the command under the filter of kernel calls.

Arguments: the filter in hexadecimal digits, and the command. Run as text, for the sandbox's user reads no file of the
grader's. Reports its own pid on INFO, as bubblewrap does of its first process, and how the command ended on STATUS.
"""

import ctypes
import os
import struct
import sys

INFO, STATUS = 100, 101
_SET_SECCOMP, _FILTER, _NO_NEW_PRIVILEGES, _SUBREAPER = 22, 2, 38, 36  # <linux/prctl.h>

if __name__ == "__main__":
    libc = ctypes.CDLL(None)
    libc.prctl(_SUBREAPER, 1, 0, 0, 0)
    os.write(INFO, b'{"child-pid": %d}' % os.getpid())
    os.close(INFO)
    if (child := os.fork()) == 0:
        os.close(STATUS)
        program = ctypes.create_string_buffer(bytes.fromhex(sys.argv[1]))
        packed = struct.pack("@HP", len(sys.argv[1]) // 16, ctypes.addressof(program))  # instructions of eight bytes
        libc.prctl(_NO_NEW_PRIVILEGES, 1, 0, 0, 0)
        if libc.prctl(_SET_SECCOMP, _FILTER, packed, 0, 0) != 0:
            sys.exit("seccomp: the filter of kernel calls was refused")
        os.execvp(sys.argv[2], sys.argv[2:])
    os.closerange(0, 3)  # its output ends with the command
    ended = 0
    while ended != child:
        ended, how = os.wait()
    os.write(STATUS, b"%d" % os.waitstatus_to_exitcode(how))
