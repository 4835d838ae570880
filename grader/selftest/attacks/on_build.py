"""Attacks by the build and by the files that it installs: CMake and Python tools run the submission's code."""

from __future__ import annotations

from grader.selftest.attacks.attack import Attack, attack, cmake

# Repeats a command's output at the end: of a build's log only the tail is kept.
_PROBE = """execute_process(COMMAND sh -c [[{}]]
  OUTPUT_FILE ${{CMAKE_BINARY_DIR}}/said.txt ERROR_FILE ${{CMAKE_BINARY_DIR}}/said_too.txt)
install(CODE "file(READ ${{CMAKE_BINARY_DIR}}/said.txt said)\nfile(READ ${{CMAKE_BINARY_DIR}}/said_too.txt too)
message(STATUS \\"ATTACK \\${{said}} \\${{too}}\\")")"""


def _shell(script: str) -> str:
    return _PROBE.format(script.strip())


ATTACKS: tuple[Attack, ...] = (
    attack(
        "runs_code_at_build",
        "CMakeLists.txt reads the host's files, writes to the cache and calls the network.",
        cmake(_shell("""
cat @SECRET@ /etc/shadow /root/.bashrc; id; ls /ws /ws/ccache
for f in /ws/ccache/evil /ws/src/evil /usr/evil @NEIGHBOUR@; do echo x > $f && echo wrote $f; done
python3 -c 'import socket; socket.create_connection(("127.0.0.1", @PORT@), 2)'
env | grep -i -E 'secret|token'
""")),
        number=34, needs="I1", proof="ATTACK",
        stopped="a build runs in a sandbox of its own: no network, and a read-only compiler cache",
    ),
    attack(
        "leaves_a_daemon_at_build",
        "CMakeLists.txt starts a process that outlives the build.",
        cmake(_shell("setsid sh -c 'while :; do sleep 1; done' @TOKEN@ >/dev/null 2>&1 </dev/null & echo started")),
        number=15, needs="I1", proof="ATTACK started",
        stopped="the sandbox is a pid namespace: when its first process ends, the kernel kills all others",
    ),
    attack(
        "fills_the_disk",
        "The build never stops writing files.",
        cmake("execute_process(COMMAND sh -c [[i=0; while [ $i -lt 400 ]; do "
              "head -c 50000000 /dev/zero > /ws/build/fill$i || break; i=$((i+1)); done]])"),
        number=24, needs="I1 F14", costs="I1 F14",
        stopped="a guard measures what a build writes, and kills it beyond a limit",
    ),
    attack(
        "builds_for_ever",
        "The build sleeps for ever.",
        cmake("execute_process(COMMAND sleep 100000)"),
        number=23, needs="I1 F14", costs="I1 F14", build_seconds=30.0,
        stopped="a build has a limit on its wall time; then its whole sandbox is killed",
    ),
    attack(
        "plants_in_the_caches",
        "The build plants an object file and a build tree for other submissions to find.",
        cmake(_shell("""
for f in /ws/ccache/0/evil /ws/ccache/ccache.conf /ws/build/../trees/evil; do
  mkdir -p $(dirname $f); echo x > $f && echo wrote $f
done
""")),
        needs="I1", proof="ATTACK",
        stopped="only the kit's own builds write to the compiler cache; no sandbox holds a build tree that is shared",
    ),
)  # fmt: skip
