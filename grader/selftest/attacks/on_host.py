"""Attacks on this machine: by the build, and by the powers that root has, or a process that is root of a namespace."""

from __future__ import annotations

from grader.selftest.attacks.attack import BEHAVIOUR, BUILD, Attack, at_build, attack, node

# root's files show who root of this machine is: in a namespace of its own a process may only call itself that.
_IS_ROOT = "os.getuid() == os.stat('/usr').st_uid"

ATTACKS: tuple[Attack, ...] = (
    attack(
        "runs_code_at_build",
        "The build reads the host's files, writes to the cache and calls the network.",
        at_build("""
cat @SECRET@ /etc/shadow /root/.bashrc; id; ls /ws /ws/ccache
for f in /ws/ccache/evil /ws/src/evil /usr/evil @NEIGHBOUR@; do echo x > $f && echo wrote $f; done
python3 -c 'import socket; socket.create_connection(("127.0.0.1", @PORT@), 2)'
env | grep -i -E 'secret|token'
"""),
        number=34, needs=BUILD, proof="ATTACK",
        stopped="a build runs in a sandbox of its own: no network, and a read-only compiler cache",
    ),
    attack(
        "leaves_a_daemon_at_build",
        "The build starts a process that outlives the build.",
        at_build("setsid sh -c 'while :; do sleep 1; done' @TOKEN@ >/dev/null 2>&1 </dev/null & echo started"),
        number=15, needs=BUILD, proof="ATTACK started",
        stopped="when a sandbox's first process ends, all others of its pid namespace, or of its user, are killed",
    ),
    attack(
        "fills_the_disk",
        "The build never stops writing files.",
        at_build("i=0; while [ $i -lt 400 ]; do "
                 "head -c 50000000 /dev/zero > /ws/build/fill$i || break; i=$((i+1)); done"),
        number=24, needs=BUILD, costs=BUILD,
        stopped="a guard measures what a build writes, and kills it beyond a limit",
    ),
    attack(
        "builds_for_ever",
        "The build sleeps for ever.",
        at_build("sleep 100000"),
        number=23, needs=BUILD, costs=BUILD, build_seconds=30.0,
        stopped="a build has a limit on its wall time; then its whole sandbox is killed",
    ),
    attack(
        "plants_in_the_caches",
        "The build plants an object file and a build tree for other submissions to find.",
        at_build("""
for f in /ws/ccache/0/evil /ws/ccache/ccache.conf /ws/build/../trees/evil; do
  mkdir -p $(dirname $f); echo x > $f && echo wrote $f
done
"""),
        needs=BUILD, proof="ATTACK",
        stopped="only the kit's own builds write to the compiler cache; no sandbox holds a build tree that is shared",
    ),
    attack(
        "is_root_of_this_machine",
        "The node looks whether it is root of this machine, and for files of root's that it may write.",
        node(f"""
root, found = os.stat('/usr').st_uid, 0
for top in ('/proc/sys', '/etc', '/dev', '/ws', '/opt', '/var', '/run', '/home', '/tmp'):
    for here, _, names in os.walk(top):
        for path in (os.path.join(here, name) for name in names):
            try:
                if os.lstat(path).st_uid == root and os.path.isfile(path):
                    os.close(os.open(path, os.O_WRONLY))
                    found += 1
            except OSError:
                pass
print('ATTACK is root:', {_IS_ROOT}, 'files of root:', found, flush=True)
os._exit(0)
"""),
        needs=BEHAVIOUR, costs=BEHAVIOUR, proof="ATTACK is root: False files of root: 0",
        stopped="where the grader is root, its sandboxes run as a user that owns nothing; else as the user who grades",
    ),
    attack(
        "builds_as_root",
        "The build looks whether it runs as root of this machine.",
        at_build(f"python3 -c \"import os; print('built as root:', {_IS_ROOT})\""),
        needs=BUILD, proof="ATTACK built as root: False",
        stopped="the same user as for nodes; what a build leaves is then given to the grader",
    ),
    attack(
        "becomes_root_of_a_namespace",
        "The node makes user namespaces, in which it would be root, and mounts the kernel's settings anew.",
        node("""
import ctypes
libc = ctypes.CDLL(None, use_errno=True)
NEW_USER, NEW_MOUNTS, NEW_PIDS = 0x10000000, 0x20000, 0x20000000
made = 0
for call in (
    lambda: libc.unshare(NEW_USER | NEW_MOUNTS | NEW_PIDS),
    lambda: libc.unshare(NEW_USER),
    lambda: libc.syscall(56, NEW_USER | NEW_MOUNTS | 17, 0, 0, 0, 0),
):
    answer = call()
    made += answer >= 0
    if answer == 0 and libc.fork() == 0:
        libc.mount(b'proc', b'/tmp', b'proc', 0, None)
made += subprocess.run(['unshare', '-Urm', 'true'], stderr=subprocess.DEVNULL).returncode == 0
mounted = libc.mount(b'proc', b'/tmp', b'proc', 0, None) == 0 or os.path.exists('/tmp/sys')
print('ATTACK namespaces:', made, 'mounted:', mounted, flush=True)
os._exit(0)
"""),
        needs=BEHAVIOUR, costs=BEHAVIOUR, proof="ATTACK namespaces: 0 mounted: False",
        stopped="a filter of kernel calls refuses user namespaces in every sandbox",
    ),
    attack(
        "calls_around_its_sandbox",
        "The node uses keyrings, sockets to the host and other calls that no namespace holds back.",
        node("""
import ctypes
import socket
libc = ctypes.CDLL(None)
answers = {
    'keyctl': libc.syscall(250, 0, -3, 1), 'add_key': libc.syscall(248, b'user', b'@TOKEN@', b'left', 4, -3),
    'request_key': libc.syscall(249, b'user', b'@TOKEN@', None, -3), 'userfaultfd': libc.syscall(323, 1),
    'io_uring': libc.syscall(425, 1, ctypes.create_string_buffer(120)),
    'ptrace': libc.syscall(101, 16, os.getppid() or 1, 0, 0), 'vsock': libc.socket(40, socket.SOCK_STREAM, 0),
    'mptcp': libc.socket(socket.AF_INET, socket.SOCK_STREAM, 262),
}
print('ATTACK calls that were answered:', [name for name, answer in answers.items() if answer >= 0], flush=True)
os._exit(0)
"""),
        needs=BEHAVIOUR, costs=BEHAVIOUR, proof="ATTACK calls that were answered: []",
        stopped="a filter of kernel calls, and a session keyring of its own for every sandbox",
        not_without_namespaces="proot answers ptrace itself, for the processes of the same sandbox",
    ),
)  # fmt: skip
