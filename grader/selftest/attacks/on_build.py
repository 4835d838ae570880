"""Attacks by the build and by the files that it installs: CMake and Python tools run the submission's code."""

from __future__ import annotations

from grader.selftest.attacks.attack import BUILD, Attack, at_build, attack

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
)  # fmt: skip
