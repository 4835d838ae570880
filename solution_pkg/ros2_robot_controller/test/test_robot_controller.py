"""The node that drives the robot, on a bench."""

import math
import signal
from types import SimpleNamespace

from action_msgs.msg import GoalStatus
from geometry_msgs.msg import Pose, Twist
from nav_msgs.msg import Odometry
import pytest
import rclpy
from rclpy.action import ActionClient
from rclpy.exceptions import InvalidParameterValueException
from rclpy.qos import ReliabilityPolicy
from ros2_robot_controller.action import NavigateToPosition
from ros2_robot_controller.robot_controller import main, RobotController
from ros2_robot_controller.srv import GetRobotStatus, SetSpeed
from ros2_robot_controller.utils.conversions import quaternion_from_yaw
from sensor_msgs.msg import LaserScan

SENSELESS = [
    ('robot_name', ''), ('max_linear_speed', -1.0), ('max_angular_speed', -0.1),
    ('linear_acceleration', 0.0), ('angular_acceleration', 0.0), ('laser_processing_rate', 0.0),
    ('fusion_rate', 0.0), ('obstacle_detection_threshold', -0.1),
    ('emergency_stop_distance', math.nan), ('safety_margin', -0.3),
]
HARMLESS = [('max_linear_speed', 0.0), ('max_angular_speed', 0.0), ('safety_margin', 0.0),
            ('obstacle_detection_threshold', 0.0), ('emergency_stop_distance', 0.0)]


def scan_of(ahead=math.inf, behind=math.inf):
    """Return a scan of four beams, the first one backwards."""
    return LaserScan(ranges=[behind, math.inf, ahead, math.inf], angle_min=-math.pi,
                     angle_increment=math.pi / 2, range_min=0.15, range_max=12.0)


def odometry(x, y, yaw=0.0):
    """Return odometry of a robot that is there."""
    odom = Odometry()
    odom.pose.pose.position.x = x
    odom.pose.pose.position.y = y
    odom.pose.pose.orientation = quaternion_from_yaw(yaw)
    return odom


class Robot:
    """The node with a robot around it that does at once what cmd_vel says."""

    def __init__(self, bench, published):
        self.bench = bench
        self.commands = published['cmd_vel']
        self.feedback = published['feedback']
        self.x = self.y = self.yaw = 0.0
        self.scan = scan_of()
        self.has_odometry = True

    def drive(self, seconds):
        """Let simulated time pass, with sensors; return the commands of that time."""
        before = len(self.commands)
        self.bench.advance(seconds, self.sense)
        return [(round(c.linear.x, 6), round(c.angular.z, 6)) for c in self.commands[before:]]

    def finish(self, goal):
        """Drive until a goal is over, at most 10 s, and 0.5 s on; return the commands."""
        commands = []
        for _ in range(100):
            if goal.result.done():
                break
            commands += self.drive(0.1)
        return commands + self.drive(0.5)

    def sense(self):
        """Move for a tick of 0.05 s, then give the node its sensors."""
        command = self.commands[-1] if self.commands else Twist()
        self.yaw += command.angular.z * 0.05
        self.x += command.linear.x * math.cos(self.yaw) * 0.05
        self.y += command.linear.x * math.sin(self.yaw) * 0.05
        if self.scan is not None:
            self.bench.hear('scan', self.scan)
        if self.has_odometry:
            self.bench.hear('odom', odometry(self.x, self.y, self.yaw))

    def set_speed(self, speed):
        return self.bench.ask('set_speed', SetSpeed.Request(speed=speed))

    def status(self):
        return self.bench.ask('get_status', GetRobotStatus.Request())

    def send(self, x, y, tolerance=0.1):
        """Send a goal; return its handle, and its result to come."""
        client = ActionClient(self.bench.node, NavigateToPosition, 'navigate_to_position')
        assert client.wait_for_server(timeout_sec=10.0)
        target = Pose()
        target.position.x, target.position.y = x, y
        handle = self.bench.until(client.send_goal_async(
            NavigateToPosition.Goal(target_pose=target, tolerance=tolerance)))
        result = handle.get_result_async() if handle.accepted else None
        self.bench.settle()
        return SimpleNamespace(handle=handle, result=result, client=client)

    def outcome(self, goal):
        """Return (status, success, x and y of the final pose) of a goal."""
        answer = self.bench.until(goal.result)
        final = answer.result.final_pose.position
        return answer.status, answer.result.success, (final.x, final.y)


@pytest.fixture
def make_robot(make_bench, published):
    """Return a function from parameters to a robot."""
    return lambda **parameters: Robot(make_bench(RobotController, **parameters), published)


@pytest.fixture
def robot(make_robot):
    """Return a robot with the default parameters."""
    return make_robot()


# The graph

def test_names_and_types_are_relative_and_as_agreed(robot):
    bench = robot.bench
    assert bench.node.get_name() == 'robot_controller'
    assert bench.service('set_speed').srv_type is SetSpeed
    assert bench.service('get_status').srv_type is GetRobotStatus
    assert bench.subscription('scan').msg_type is LaserScan
    assert bench.subscription('odom').msg_type is Odometry
    assert bench.publisher('cmd_vel').msg_type is Twist


def test_sensors_may_be_best_effort_and_commands_are_reliable(robot):
    for topic in ('scan', 'odom'):
        qos = robot.bench.subscription(topic).qos_profile
        assert qos.reliability == ReliabilityPolicy.BEST_EFFORT
    qos = robot.bench.publisher('cmd_vel').qos_profile
    assert (qos.reliability, qos.depth) == (ReliabilityPolicy.RELIABLE, 10)


# Driving

def test_without_a_command_it_says_zero_ten_times_a_second(robot):
    assert robot.drive(2.0) == [(0.0, 0.0)] * 20


def test_it_drives_at_the_set_speed(robot):
    robot.drive(0.2)
    answer = robot.set_speed(0.25)
    assert answer.success
    assert '0.25 m/s' in answer.message
    assert robot.drive(0.5) == [(0.1, 0.0), (0.2, 0.0), (0.25, 0.0), (0.25, 0.0), (0.25, 0.0)]
    assert robot.status().speed == 0.25


def test_it_drives_backwards(robot):
    robot.drive(0.2)
    assert robot.set_speed(-0.5).success
    assert robot.drive(0.6)[-1] == (-0.5, 0.0)


@pytest.mark.parametrize('speed', [0.75, -0.75, math.nan, math.inf])
def test_a_speed_beyond_the_limit_changes_nothing(robot, speed):
    robot.set_speed(0.25)
    answer = robot.set_speed(speed)
    assert not answer.success
    assert '0.5 m/s' in answer.message
    assert robot.status().speed == 0.25
    assert robot.drive(1.0)[-1] == (0.25, 0.0)


def test_the_answer_is_logged_under_the_name_of_the_robot(logged, make_robot):
    make_robot(robot_name='anna').set_speed(0.25)
    assert logged[0] == ('INFO', 'anna is ready')
    assert logged[1][1].startswith('anna: Speed set to 0.25')


def test_float32_does_not_cost_the_last_bit_of_the_limit(make_robot):
    """0.3 in a float32 field is 0.30000001."""
    robot = make_robot(max_linear_speed=0.3)
    assert robot.set_speed(0.30000001192092896).success
    assert robot.drive(1.0)[-1] == (0.3, 0.0)
    assert robot.bench.node.get_parameter('max_linear_speed').value == 0.3
    assert max(c.linear.x for c in robot.commands) <= 0.3


def test_braking_is_free_and_turning_round_passes_through_zero(robot):
    robot.set_speed(0.5)
    robot.drive(1.0)
    robot.set_speed(0.2)
    assert robot.drive(0.1) == [(0.2, 0.0)]
    robot.set_speed(-0.2)
    assert robot.drive(0.3) == [(0.0, 0.0), (-0.1, 0.0), (-0.2, 0.0)]


def test_a_late_control_step_makes_no_jump(make_robot):
    """The clock jumps by 0.4 s; that is worth two periods of speeding up, 0.2 m/s, not 0.4."""
    robot = make_robot()
    robot.drive(0.2)
    robot.set_speed(0.5)
    robot.bench.set_clock(robot.bench.now_ns + 400_000_000)
    robot.bench.hear('scan', robot.scan)
    robot.bench.settle()
    assert robot.commands[-1].linear.x == pytest.approx(0.2)


def test_a_clock_that_is_set_back_does_not_start_the_robot(robot):
    robot.drive(1.0)
    robot.set_speed(0.5)
    robot.bench.set_clock(robot.bench.now_ns - 10**9)
    robot.scan = None
    assert set(robot.drive(0.3)) <= {(0.0, 0.0)}


# Obstacles

def test_an_obstacle_stops_it_at_once_and_lets_it_go_on(robot):
    robot.set_speed(0.5)
    robot.drive(1.05)  # ends between two control steps
    robot.bench.hear('scan', scan_of(ahead=0.49))
    assert robot.commands[-1] == Twist()
    sent = len(robot.commands)
    robot.bench.hear('scan', scan_of(ahead=0.48))
    assert len(robot.commands) == sent, 'one stop is enough'
    robot.scan = scan_of(ahead=0.45)
    assert set(robot.drive(0.5)) == {(0.0, 0.0)}
    status = robot.status()
    assert (status.obstacle_detected, status.status) == (True, 'OBSTACLE_DETECTED')
    assert status.speed == 0.5
    robot.scan = scan_of()
    assert robot.drive(1.0)[-1] == (0.5, 0.0)
    status = robot.status()
    assert (status.obstacle_detected, status.status) == (False, 'ACTIVE')


def test_a_free_scan_alone_publishes_nothing(robot):
    robot.set_speed(0.5)
    robot.drive(1.0)
    sent = len(robot.commands)
    robot.bench.hear('scan', scan_of())
    assert len(robot.commands) == sent


def test_an_obstacle_behind_does_not_stop_it(robot):
    robot.set_speed(0.5)
    robot.scan = scan_of(behind=0.3)
    assert robot.drive(1.0)[-1] == (0.5, 0.0)
    assert robot.status().status == 'ACTIVE'


def test_driving_backwards_it_looks_backwards(robot):
    robot.set_speed(-0.5)
    robot.scan = scan_of(behind=0.3)
    assert set(robot.drive(1.0)) == {(0.0, 0.0)}
    assert robot.status().status == 'OBSTACLE_DETECTED'


def test_it_slows_down_near_an_obstacle(robot):
    robot.set_speed(0.5)
    robot.scan = scan_of(ahead=0.65)
    assert robot.drive(1.0)[-1] == (0.25, 0.0)


def test_it_does_not_drive_blind(robot):
    robot.scan = None
    robot.set_speed(0.5)
    assert set(robot.drive(1.0)) == {(0.0, 0.0)}
    robot.scan = scan_of()
    assert robot.drive(1.0)[-1] == (0.5, 0.0)
    robot.scan = None
    assert robot.drive(0.45)[-1] == (0.5, 0.0), 'a few missed scans are no reason to stop'
    assert robot.drive(0.25)[-1] == (0.0, 0.0)


# Navigating

@pytest.mark.parametrize('target', [(1.0, 0.0), (0.0, 0.8), (-0.7, 0.3), (-0.5, -0.5)])
def test_it_drives_to_a_goal_and_stands_still_there(robot, target):
    robot.drive(0.2)
    goal = robot.send(*target)
    commands = robot.finish(goal)
    status, success, final = robot.outcome(goal)
    assert (status, success) == (GoalStatus.STATUS_SUCCEEDED, True)
    assert math.dist((robot.x, robot.y), target) < 0.1
    assert math.dist(final, (robot.x, robot.y)) < 0.02
    assert commands[-5:] == [(0.0, 0.0)] * 5
    assert max(v for v, _ in commands) <= 0.5
    assert max(abs(omega) for _, omega in commands) <= 1.0
    for (v, omega), (v_next, omega_next) in zip(commands, commands[1:]):
        assert v_next - v <= 0.1 + 1e-5
        assert abs(omega_next) - abs(omega) <= 0.2 + 1e-5


def test_feedback_tells_the_distance_twenty_times_a_second(robot):
    robot.drive(0.2)
    robot.send(2.0, 0.0)
    robot.drive(2.0)
    distances = [message.distance_remaining for message in robot.feedback]
    assert 39 <= len(distances) <= 41
    assert distances[0] == pytest.approx(2.0, abs=0.05)
    assert distances[-1] == pytest.approx(2.0 - robot.x, abs=0.05)


def test_without_odometry_there_is_no_feedback_and_no_motion(robot):
    robot.has_odometry = False
    goal = robot.send(2.0, 0.0)
    assert set(robot.drive(1.0)) == {(0.0, 0.0)}
    assert robot.feedback == []
    assert not goal.result.done()


def test_a_goal_waits_while_odometry_is_missing(robot):
    robot.drive(0.2)
    goal = robot.send(2.0, 0.0)
    assert robot.drive(1.0)[-1] == (0.5, 0.0)
    robot.has_odometry = False
    assert robot.drive(0.7)[-1] == (0.0, 0.0)
    robot.has_odometry = True
    robot.finish(goal)
    assert robot.outcome(goal)[1]


def test_old_odometry_is_no_arrival(robot):
    robot.drive(0.2)
    robot.has_odometry = False
    robot.drive(0.6)
    goal = robot.send(0.0, 0.0)
    robot.drive(0.3)
    assert not goal.result.done()
    robot.has_odometry = True
    robot.drive(0.3)
    assert robot.outcome(goal)[1]


@pytest.mark.parametrize('field', ['x', 'y'])
def test_odometry_that_is_no_number_counts_as_missing(robot, field):
    robot.bench.hear('odom', odometry(1.0, 2.0))
    odom = odometry(3.0, 4.0)
    setattr(odom.pose.pose.position, field, math.nan)
    robot.bench.hear('odom', odom)
    pose = robot.status().pose
    assert (pose.position.x, pose.position.y) == (1.0, 2.0)


def test_the_status_tells_the_pose_from_odometry(robot):
    robot.bench.hear('odom', odometry(1.0, -2.0, 0.5))
    pose = robot.status().pose
    assert (pose.position.x, pose.position.y) == (1.0, -2.0)
    assert pose.orientation == quaternion_from_yaw(0.5)


def test_a_canceled_goal_stops_the_robot(robot):
    robot.drive(0.2)
    goal = robot.send(2.0, 0.0)
    assert robot.drive(1.0)[-1] == (0.5, 0.0)
    answer = robot.bench.until(goal.handle.cancel_goal_async())
    assert len(answer.goals_canceling) == 1
    assert robot.drive(0.2)[-1] == (0.0, 0.0)
    status, success, final = robot.outcome(goal)
    assert (status, success) == (GoalStatus.STATUS_CANCELED, False)
    assert final == pytest.approx((robot.x, robot.y), abs=0.05)
    feedback = len(robot.feedback)
    assert set(robot.drive(1.0)) == {(0.0, 0.0)}
    assert len(robot.feedback) == feedback


def test_a_blocked_goal_waits_and_is_completed_when_the_way_is_free(robot):
    robot.drive(0.2)
    goal = robot.send(1.0, 0.0)
    robot.drive(0.5)
    robot.scan = scan_of(ahead=0.4)
    assert set(robot.drive(2.0)) == {(0.0, 0.0)}
    assert robot.status().status == 'OBSTACLE_DETECTED'
    assert not goal.result.done()
    robot.scan = scan_of()
    robot.finish(goal)
    assert robot.outcome(goal)[1]


def test_an_obstacle_ahead_does_not_keep_it_from_turning_to_its_goal(robot):
    robot.scan = scan_of(ahead=0.4)
    robot.drive(0.2)
    robot.send(-2.0, 0.0)
    assert robot.drive(0.6)[-1] == (0.0, 1.0)
    robot.scan = scan_of(behind=0.19)
    assert robot.drive(0.2)[-1] == (0.0, 0.0)


def test_navigating_it_looks_forward_whatever_the_speed_in_force(robot):
    robot.set_speed(-0.5)
    robot.scan = scan_of(ahead=0.4)
    robot.drive(0.2)
    assert robot.status().status == 'ACTIVE'
    robot.send(2.0, 0.0)
    robot.drive(0.2)
    assert robot.status().status == 'OBSTACLE_DETECTED'


def test_an_obstacle_at_the_goal_ends_the_drive_within_the_tolerance(robot):
    robot.scan = scan_of(ahead=0.4)
    robot.drive(0.2)
    goal = robot.send(0.25, 0.0, tolerance=0.3)
    robot.drive(0.2)
    assert robot.outcome(goal)[1]


def test_the_speed_in_force_is_zero_after_a_goal(robot):
    robot.set_speed(0.3)
    robot.drive(0.5)
    goal = robot.send(0.7, 0.0)
    robot.set_speed(0.5)
    robot.finish(goal)
    assert robot.outcome(goal)[1]
    assert robot.status().speed == 0.0
    assert set(robot.drive(0.5)) == {(0.0, 0.0)}


def test_a_new_goal_replaces_the_running_one(robot):
    robot.drive(0.2)
    first = robot.send(3.0, 0.0)
    robot.drive(0.5)
    second = robot.send(1.0, 0.0)
    assert robot.outcome(first)[:2] == (GoalStatus.STATUS_ABORTED, False)
    robot.finish(second)
    assert robot.outcome(second)[1]
    assert robot.x == pytest.approx(1.0, abs=0.06)


def test_a_goal_that_makes_no_sense_is_rejected(logged, robot):
    assert not robot.send(math.nan, 0.0).handle.accepted
    assert not robot.send(1.0, 0.0, tolerance=0.0).handle.accepted
    assert [line for line in logged if line[0] == 'WARN'] == [
        ('WARN', 'Goal rejected: the target (nan, 0.0) is no place'),
        ('WARN', 'Goal rejected: a tolerance of 0.0 m cannot be met')]


@pytest.mark.parametrize(('first', 'words'), [
    (lambda robot, goal: robot.finish(goal), 'turtlebot4: goal arrived'),
    (lambda robot, goal: (robot.bench.until(goal.handle.cancel_goal_async()), robot.drive(0.2)),
     'turtlebot4: goal canceled'),
    (lambda robot, goal: (robot.send(9.0, 9.0), robot.drive(0.1)), 'turtlebot4: goal replaced'),
])
def test_how_a_goal_ended_is_logged(logged, robot, first, words):
    robot.drive(0.2)
    first(robot, robot.send(0.5, 0.0))
    assert ('INFO', words) in logged


# Parameters

def test_the_defaults_are_those_of_the_contract(robot):
    names = ['robot_name', 'max_linear_speed', 'max_angular_speed', 'linear_acceleration',
             'angular_acceleration', 'laser_processing_rate', 'fusion_rate',
             'obstacle_detection_threshold', 'emergency_stop_distance', 'safety_margin']
    assert [robot.bench.node.get_parameter(name).value for name in names] == [
        'turtlebot4', 0.5, 1.0, 1.0, 2.0, 10.0, 20.0, 0.5, 0.2, 0.3]


@pytest.mark.parametrize(('name', 'value'), SENSELESS)
def test_a_senseless_value_is_refused_at_start(make_robot, name, value):
    with pytest.raises(InvalidParameterValueException, match=name):
        make_robot(**{name: value})


@pytest.mark.parametrize(('name', 'value'), SENSELESS)
def test_a_senseless_value_is_refused_at_run_time(robot, name, value):
    before = robot.bench.node.get_parameter(name).value
    answer = robot.bench.set_parameter(name, value)
    assert not answer.successful
    assert name in answer.reason
    assert robot.bench.node.get_parameter(name).value == before


@pytest.mark.parametrize(('name', 'value'), HARMLESS)
def test_zero_is_a_sensible_limit(robot, name, value):
    assert robot.bench.set_parameter(name, value).successful


def test_a_lower_limit_slows_the_robot_down(robot):
    robot.set_speed(0.5)
    robot.drive(1.0)
    robot.bench.set_parameter('max_linear_speed', 0.25)
    assert robot.status().speed == 0.25
    assert robot.drive(0.1) == [(0.25, 0.0)]
    assert not robot.set_speed(0.375).success


def test_a_lower_limit_holds_backwards_too(robot):
    robot.set_speed(-0.5)
    robot.bench.set_parameter('max_linear_speed', 0.25)
    assert robot.status().speed == -0.25


def test_another_threshold_is_in_force_at_once(robot):
    robot.set_speed(0.25)
    robot.scan = scan_of(ahead=0.9)
    assert robot.drive(0.5)[-1] == (0.25, 0.0)
    robot.bench.set_parameter('obstacle_detection_threshold', 1.0)
    assert robot.drive(0.2)[-1] == (0.0, 0.0)


def test_the_control_loop_follows_its_rate(robot):
    robot.bench.set_parameter('laser_processing_rate', 5.0)
    robot.drive(0.2)
    assert len(robot.drive(2.0)) == 10
    robot.set_speed(0.5)
    assert robot.drive(0.4) == [(0.2, 0.0), (0.4, 0.0)]


def test_feedback_follows_its_rate(robot):
    robot.bench.set_parameter('fusion_rate', 5.0)
    robot.drive(0.2)
    robot.send(3.0, 0.0)
    robot.drive(2.0)
    assert 9 <= len(robot.feedback) <= 11


def test_a_rate_given_at_start_counts(make_robot):
    robot = make_robot(laser_processing_rate=5.0, fusion_rate=4.0)
    robot.drive(0.2)
    assert len(robot.drive(2.0)) == 10
    robot.send(3.0, 0.0)
    robot.drive(2.0)
    assert 7 <= len(robot.feedback) <= 9


def test_another_parameter_leaves_the_rhythms_alone(make_robot):
    """A timer made anew would start its period anew."""
    robot = make_robot(fusion_rate=5.0)
    robot.drive(0.2)
    robot.send(3.0, 0.0)
    robot.drive(0.15)
    robot.bench.set_parameter('safety_margin', 0.25)
    feedback = len(robot.feedback)
    assert len(robot.drive(0.05)) == 1
    assert len(robot.feedback) == feedback + 1


# The end

def test_stop_says_zero(robot):
    robot.set_speed(0.5)
    assert robot.drive(1.0)[-1] == (0.5, 0.0)
    robot.bench.node.stop()
    assert robot.commands[-1] == Twist()


@pytest.mark.parametrize('number', [signal.SIGINT, signal.SIGTERM])
def test_a_signal_ends_it_with_a_last_zero(published, interrupt, number):
    interrupt(number)
    assert main() == 0
    assert not rclpy.ok()
    assert published['/cmd_vel'][-1] == Twist()


def test_a_senseless_value_on_the_command_line_ends_it_in_words(logged, interrupt):
    interrupt(signal.SIGINT)
    assert main(['--ros-args', '-p', 'max_linear_speed:=-1.0']) == 1
    assert not rclpy.ok()
    assert logged[-1][0] == 'FATAL'
    assert 'max_linear_speed must be finite and not negative' in logged[-1][1]
