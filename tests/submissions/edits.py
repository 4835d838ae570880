"""The known-bad submissions: the reference with one named edit each, and which requirements the edit should cost.

An edit replaces text in a copy of the reference, or removes files. A text must match exactly once, so an edit that no
longer applies because the reference has changed is an error and not a silent pass.

`python -m submissions.table` (in tests/) grades every edit and prints edit x requirement; `submissions.known_bad` says
which check each edit fails.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from grader import KIT
from grader.authoring.package_edits import Change, copy, remove, rename, replace

REFERENCE = KIT / "solution_pkg" / "ros2_robot_controller"

_CONTROLLER = "ros2_robot_controller/robot_controller.py"
_DRIVER = "ros2_robot_controller/driver.py"
_SPEED_SERVER = "ros2_robot_controller/speed_server.py"
_NAVIGATOR = "ros2_robot_controller/navigator.py"
_PROCESSOR = "ros2_robot_controller/sensor_processor.py"
_MOTION = "ros2_robot_controller/utils/motion.py"
_STEERING = "ros2_robot_controller/utils/steering.py"
_SCANS = "ros2_robot_controller/utils/scans.py"
_RUNNING = "ros2_robot_controller/utils/running.py"
_SETTINGS = "ros2_robot_controller/utils/settings.py"
_CONVERSIONS = "ros2_robot_controller/utils/conversions.py"
_CMAKE = "CMakeLists.txt"
_LAUNCH = "launch/robot_controller_launch.py"
_START = "scripts/robot_controller"
_DEMO = "scripts/demo.py"
_PACKAGE_XML = "package.xml"
_README = "README.md"


@dataclass(frozen=True)
class Edit:
    """One mistake.

    Attributes:
        name: its name in tables and tests.
        sentence: what is wrong.
        changes: what it does to the package.
        costs: the requirements that lose points by it, of those that are judged by the build and the trials; of the
            others (Q, T, I2) only those that the edit is about.
        says: words that the report must contain.
        why: why it costs more than one requirement.
    """

    name: str
    sentence: str
    changes: tuple[Change, ...]
    costs: frozenset[str]
    says: tuple[str, ...] = ()
    why: str = ""


def apply(edit: Edit | None, folder: Path) -> Path:
    """Copy the reference below `folder`, make the edit, and return the package's path."""
    package = copy(REFERENCE, folder)
    for change in edit.changes if edit else ():
        change(package)
    return package


def _edit(
    name: str, costs: str, sentence: str, *changes: tuple[str, str, str], says: tuple[str, ...] = (), why: str = "",
    removes: tuple[str, ...] = (), renames: tuple[tuple[str, str], ...] = (),
) -> Edit:  # fmt: skip
    made = (
        *(replace(*change) for change in changes), *map(remove, removes), *(rename(*texts) for texts in renames)
    )  # fmt: skip
    return Edit(name, sentence, made, frozenset(costs.split()), says, why)


_NAME = REFERENCE.name
_OTHER_NAME = "robot_controller"
# Where ROS's tools read a package's name; the Python package of its modules keeps the contract's.
_IN_ROS = tuple(
    (text.format(_NAME), text.format(_OTHER_NAME))
    for text in (
        "<name>{}<", "project({})", "name='{}'", "package='{}'", "FindPackageShare('{}')",
        "get_package_share_directory('{}')", "{}.action import", "{}.srv import", "{}.msg import", "{}/action/", "{}/srv/",
        "{}/msg/", "ros2 launch {}", "ros2 run {}", "--packages-select {}",
    )
)  # fmt: skip


_EDITS = (
    # -- the build and the start ----------------------------------------------------------------------------------
    _edit(
        "does_not_compile",
        "F1 F2 F3 F4 F5 F6 F7 F8 F9 F10 F11 F12 F13 F14 I1 I3 I4 I5 I6 I7 I8",
        "CMakeLists.txt names an interface file that does not exist.",
        (_CMAKE, '"msg/SensorFusionData.msg"', '"msg/FusedData.msg"'),
        says=("FusedData.msg", "colcon build"),
        why="nothing can be judged without a build",
    ),
    _edit(
        "crashes_at_start",
        "F1 F2 F3 F4 F5 F6 F7 F8 F9 F10 F11 I3 I4 I5 I6 I7 I8",
        "The controller crashes before it creates its node.",
        (_START, "sys.exit(main())", "raise RuntimeError('no robot on /dev/ttyACM0')"),
        says=("no robot on /dev/ttyACM0", "ended before it came up"),
        why="everything that the controller should do depends on it",
    ),
    _edit(
        "forgets_the_config",
        "I1 I5 I6",
        "The parameter files are not installed.",
        (_CMAKE, "install(DIRECTORY launch config", "install(DIRECTORY launch"),
        says=("config/robot_params.yaml",),
        why="neither the nodes (I6) nor the launch files (I5) can load a file that is not installed",
    ),
    _edit(
        "forgets_an_executable",
        "F12 F13 I1 I3 I4 I5 I6 I7 I8",
        "sensor_processor is not installed.",
        (_CMAKE, "scripts/robot_controller scripts/sensor_processor\n", "scripts/robot_controller\n"),
        says=("not installed: sensor_processor",),
        why="nothing can be seen of a node that cannot be started",
    ),
    _edit(
        "renames_the_package",
        "I1 I3",
        "The package, its folder of modules and its types have another name than the contract's.",
        renames=((_NAME, _OTHER_NAME),),
        says=(
            "It builds, as robot_controller; the assignment asks for ros2_robot_controller.",
            "expected set_speed (SetSpeed)",
        ),
        why="the package's name is also that of its types (I3)",
    ),
    _edit(
        "renames_all_but_its_modules",
        "I1 I3",
        "package.xml and CMakeLists.txt have another name than the contract's, and so have the types.",
        (_CMAKE, "install(DIRECTORY ${PROJECT_NAME}/\n  DESTINATION ${PYTHON_INSTALL_DIR}/${PROJECT_NAME}\n",
         f"install(DIRECTORY {_NAME}/\n  DESTINATION ${{PYTHON_INSTALL_DIR}}/{_NAME}\n"),
        renames=_IN_ROS,
        says=("It builds, as robot_controller; the assignment asks for ros2_robot_controller.",),
        why="the package's name is also that of its types (I3)",
    ),
    _edit(
        "installs_executables_in_bin",
        "I1",
        "The executables are installed in bin.",
        (_CMAKE, "install(PROGRAMS scripts/robot_controller scripts/sensor_processor\n  DESTINATION lib/${PROJECT_NAME})",
         "install(PROGRAMS scripts/robot_controller scripts/sensor_processor\n  DESTINATION bin)"),
        says=("bin/robot_controller, bin/sensor_processor: `ros2 run` looks in lib/ros2_robot_controller",),
    ),
    # -- F1 -------------------------------------------------------------------------------------------------------
    _edit(
        "silent_when_idle",
        "F1",
        "Commands are published only while the robot moves.",
        (_DRIVER, "        twist = Twist()\n",
         "        if command == STOP == self._last_command:\n            return\n        twist = Twist()\n"),
        says=("no message on cmd_vel",),
    ),
    _edit(
        "half_the_rate",
        "F1",
        "The control loop runs at half its rate.",
        (_DRIVER, "self.create_timer(self._period(", "self.create_timer(2.0 * self._period("),
        says=("5.0 Hz",),
    ),
    _edit(
        "silent_before_the_first_scan",
        "F1",
        "The control loop publishes nothing before the first scan.",
        (_DRIVER, "        safe = motion.make_safe(wanted",
         "        if self._scan_time == NEVER:\n            return\n        safe = motion.make_safe(wanted"),
        says=("before the first scan",),
    ),
    # -- F2, F3 ---------------------------------------------------------------------------------------------------
    _edit(
        "drives_too_slowly",
        "F2",
        "The robot drives at 80 % of the speed that was set.",
        (_DRIVER, "return Command(v=self._speed)", "return Command(v=0.8 * self._speed)"),
        says=("m/s by odometry",),
    ),
    _edit(
        "never_backwards",
        "F2",
        "A negative speed drives the robot forwards.",
        (_DRIVER, "return Command(v=self._speed)", "return Command(v=abs(self._speed))"),
        says=("after set_speed -",),
    ),
    _edit(
        "ignores_the_limit",
        "F3 I6",
        "set_speed accepts any finite speed.",
        (_SPEED_SERVER, "if abs(speed) > limit * (1.0 + FLOAT32_SLACK):", "if abs(speed) > 1000.0:"),
        (_SPEED_SERVER, "self._speed = clamp(request.speed, -limit, limit)", "self._speed = request.speed"),
        says=("success = True", "compare abs(speed) with the limit"),
        why="overriding max_linear_speed has no effect either (I6)",
    ),
    _edit(
        "keeps_its_first_limits",
        "F3 F11",
        "The parameters are read once; what they are set to later is accepted, and has no effect.",
        (_DRIVER, "        return self.get_parameter(parameter).value\n",
         "        first = self.__dict__.setdefault('_first_values', {})\n"
         "        return first.setdefault(parameter, self.get_parameter(parameter).value)\n"),
        says=("after max_linear_speed was set to 0.25", "after a change of the parameters"),
        why="both requirements ask for the limit in force",
    ),
    _edit(
        "keeps_the_limits_of_a_goals_start",
        "F11",
        "A goal is driven to within the limits that held when it came.",
        (_NAVIGATOR, "        self._goal = goal\n        ending", "        self._first = self._limits()\n        self._goal = goal\n        ending"),
        (_NAVIGATOR, "    def _direction(self)",
         "    def _limits(self) -> Limits:\n        return super()._limits() if self._goal is None else self._first\n\n"
         "    def _direction(self)"),
        says=("after a change of the parameters",),
    ),
    _edit(
        "refuses_every_speed",
        "F2 F3 F4 F5 F6 F7 F11 I6",
        "set_speed refuses every speed.",
        (_SPEED_SERVER, "response.success = not refusal\n",
         "refusal = refusal or f'not now, the limit is {limit}'\n        response.success = not refusal\n"),
        says=("was refused as well",),
        why="a robot that nobody can drive shows little else",
    ),
    _edit(
        "accepts_nan_as_a_speed",
        "F3",
        "The test for NaN is left out, and NaN passes every comparison.",
        (_SPEED_SERVER, "    if not math.isfinite(speed):\n", "    if math.isinf(speed):\n"),
        says=("speed nan answered success = True",),
    ),
    _edit(
        "refuses_without_the_limit",
        "F3",
        "A refusal does not say which limit holds.",
        (_SPEED_SERVER, "is beyond the limit of {limit:.3g} m/s'", "is too fast'"),
        says=("say in the message which limit holds",),
    ),
    _edit(
        "stops_when_it_refuses",
        "F3",
        "A refused speed sets the speed in force to 0.",
        (_SPEED_SERVER, "            response.message = f'Speed unchanged: {refusal}'\n",
         "            self._speed = 0.0\n            response.message = f'Speed unchanged: {refusal}'\n"),
        says=("m/s after them",),
    ),
    _edit(
        "backs_up_slowly",
        "F2",
        "Backwards the robot drives at half the limit at most.",
        (_MOTION, "v=clamp(wanted.v, -cap, cap)", "v=clamp(wanted.v, -0.5 * cap, cap)"),
        says=("after set_speed -0.5",),
    ),
    _edit(
        "refuses_the_limit_itself",
        "F2",
        "Only speeds below the limit are accepted.",
        (_SPEED_SERVER, "if abs(speed) > limit * (1.0 + FLOAT32_SLACK):", "if abs(speed) >= limit:"),
        says=("the limit itself is allowed",),
    ),
    _edit(
        "states_a_fixed_limit",
        "F3",
        "A refusal names the default limit, whatever the parameter says.",
        (_SPEED_SERVER, "is beyond the limit of {limit:.3g} m/s'", "is beyond the limit of 0.5 m/s'"),
        says=("put the parameter's value into the message",),
    ),
    _edit(
        "accepts_any_speed_during_a_goal",
        "F3",
        "While there is a goal, every speed is accepted, for later.",
        (_NAVIGATOR, "    # On the way\n",
         "    def _on_set_speed(self, request: Any, response: Any) -> Any:\n"
         "        if self._goal is None:\n"
         "            return super()._on_set_speed(request, response)\n"
         "        response.success, response.message = True, 'later'\n"
         "        return response\n\n"
         "    # On the way\n"),
        says=("answered success = True on the way to a goal",),
    ),
    _edit(
        "ignores_a_speed_of_zero",
        "F2",
        "A speed of 0 is accepted and changes nothing.",
        (_SPEED_SERVER, "            self._speed = clamp(request.speed, -limit, limit)\n",
         "            if request.speed:\n                self._speed = clamp(request.speed, -limit, limit)\n"),
        says=("after set_speed 0 was accepted",),
    ),
    # -- F4, F5 ---------------------------------------------------------------------------------------------------
    _edit(
        "drives_into_the_wall",
        "F4 F5 F6 F11 I6",
        "The obstacle flag is set and reported, but the robot does not stop.",
        (_MOTION, "    if wanted.v != 0.0 and obstacle_in_way(near, wanted.v, limits):\n        return STOP\n", ""),
        (_MOTION, "        return STOP\n    cap = speed_cap", "        return wanted\n    cap = speed_cap"),
        says=("touched the",),
        why="F5, F6, F11 and I6 (another threshold) ask for a robot that stops for an obstacle",
    ),
    _edit(
        "stops_late",
        "F4",
        "The obstacle stop uses a scan that is half a second old.",
        (_DRIVER, "        self._near = measure_proximity(scan)\n",
         "        self._past = [*getattr(self, '_past', []), measure_proximity(scan)][-6:]\n"
         "        self._near = self._past[0]\n"),
        says=("after the first scan below 0.5 m",),
    ),
    _edit(
        "looks_to_the_left",
        "F4",
        "Of what lies to the right only 10 degrees count as in the way.",
        (_SCANS, "        if abs(normalize_angle(angle)) <= SECTOR_HALF_WIDTH:\n",
         "        if -0.2 <= normalize_angle(angle) <= SECTOR_HALF_WIDTH:\n"),
        says=("degrees to one side, and up to 60 count as ahead",),
    ),
    _edit(
        "looks_straight_ahead",
        "F4",
        "Only what is within 45 degrees to each side counts as in the way.",
        (_SCANS, "SECTOR_HALF_WIDTH = math.radians(60.0)", "SECTOR_HALF_WIDTH = math.radians(45.0)"),
        says=("up to 60 count as ahead",),
    ),
    _edit(
        "never_forgets_an_obstacle",
        "F5 F7 F11",
        "An obstacle that was seen once is never forgotten.",
        (_DRIVER, "        self._near = measure_proximity(scan)\n",
         "        near = measure_proximity(scan)\n"
         "        self._near = min(near, self._near, key=lambda seen: seen.ahead)\n"),
        says=("where is the obstacle flag cleared",),
        why="a goal whose way was blocked is never completed (F11)",
    ),
    _edit(
        "looks_all_around",
        "F5",
        "Anything near counts as in the way, in every direction.",
        (_SCANS, "        ahead=min(ahead, default=math.inf),", "        ahead=closest_reading(scan),"),
        says=("with something 0.",),
    ),
    _edit(
        "brakes_gently",
        "F4",
        "The robot slows down no faster than it speeds up, and only in the control loop.",
        (_DRIVER, "        if motion.make_safe(self._last_command, self._near, self._limits()) == STOP:\n"
         "            if self._last_command != STOP:\n                self._publish(STOP)\n", ""),
        (_MOTION, "    return math.copysign(min(abs(wanted), abs(previous) + largest_rise), wanted)",
         "    wanted = max(abs(wanted), abs(previous) - largest_rise) * math.copysign(1.0, previous or wanted)\n"
         "    return math.copysign(min(abs(wanted), abs(previous) + largest_rise), wanted)"),
        says=("after the first scan below 0.5 m",),
    ),
    _edit(
        "creeps_on",
        "F4",
        "A robot that drives slowly is not stopped.",
        (_DRIVER, "        safe = motion.make_safe(wanted, self._near, limits)\n",
         "        safe = wanted if abs(wanted.v) <= 0.12 and not wanted.omega else motion.make_safe(wanted, self._near, limits)\n"),
        (_DRIVER, "        if motion.make_safe(self._last_command, self._near, self._limits()) == STOP:\n"
                  "            if self._last_command != STOP:\n",
         "        if motion.make_safe(self._last_command, self._near, self._limits()) == STOP:\n"
         "            if abs(self._last_command.v) > 0.12:\n"),
        says=("no zero came after",),
    ),
    _edit(
        "overlooks_what_few_beams_see",
        "F4",
        "The closest tenth of the readings ahead is dropped as noise.",
        (_SCANS, "        ahead=min(ahead, default=math.inf),",
         "        ahead=sorted(ahead)[len(ahead) // 10] if ahead else math.inf,"),
        says=("to one side",),
    ),
    _edit(
        "looks_at_every_tenth_beam",
        "F4 F12",
        "Of a scan only every tenth beam is looked at.",
        (_SCANS, "enumerate(scan.ranges):", "list(enumerate(scan.ranges))[::10]:"),
        says=("to one side",),
        why="both nodes read scans through one function (F12)",
    ),
    _edit(
        "emergency_for_good",
        "F5",
        "An obstacle within the emergency distance stops the robot for good.",
        (_DRIVER, "        safe = motion.make_safe(wanted, self._near, limits)\n",
         "        self._alarmed = getattr(self, '_alarmed', False) or (\n"
         "            self._near.anywhere < limits.emergency_stop_distance)\n"
         "        safe = STOP if self._alarmed else motion.make_safe(wanted, self._near, limits)\n"),
        says=("from 1 s after it was gone",),
    ),
    _edit(
        "turns_on_in_an_emergency",
        "F4",
        "Something within the emergency distance stops the robot from driving, not from turning on the spot.",
        (_MOTION, "    if near.anywhere < limits.emergency_stop_distance:\n        return STOP\n"
                  "    if wanted.v != 0.0 and obstacle_in_way", "    if wanted.v != 0.0 and obstacle_in_way"),
        says=("after the first scan below 0.2 m; something was behind the robot",),
    ),
    _edit(
        "remembers_the_slowed_speed",
        "F5",
        "At a stop the speed of the moment, slowed down before the obstacle, is kept as the one to go on at.",
        (_DRIVER, "            if self._last_command != STOP:\n                self._publish(STOP)\n",
         "            if self._last_command != STOP:\n                self._speed = self._last_command.v\n"
         "                self._publish(STOP)\n"),
        says=("had slowed down and stopped",),
    ),
    # -- F6 -------------------------------------------------------------------------------------------------------
    _edit(
        "believes_every_reading",
        "F6 F12",
        "Readings are not filtered.",
        (_SCANS, "        if in_range and 0.0 < distance < math.inf:", "        if in_range or not in_range:"),
        says=("the robot did not drive on through scans full of",),
        why="the reference filters for both nodes in one function",
    ),
    _edit(
        "crashes_on_an_empty_scan",
        "F6",
        "The controller looks at the first reading of every scan.",
        (_DRIVER, "        self._near = measure_proximity(scan)\n",
         "        self._first = scan.ranges[0]\n        self._near = measure_proximity(scan)\n"),
        says=("IndexError",),
    ),
    _edit(
        "keeps_the_last_valid_scan",
        "F6",
        "A scan without a valid reading leaves the state of the scan before it.",
        (_DRIVER, "        self._near = measure_proximity(scan)\n",
         "        near = measure_proximity(scan)\n        if math.isfinite(near.anywhere):\n"
         "            self._near = near\n"),
        says=("all beams read +inf",),
    ),
    _edit(
        "controller_without_a_scan",
        "F4 F6 F7 F11 I4 I6",
        "The controller does not subscribe to the scan, and drives all the same.",
        (_DRIVER, "        self.create_subscription(LaserScan, 'scan', self._on_scan, qos_profile_sensor_data)\n", ""),
        (_DRIVER, "self._wanted(limits) if self._is_fresh(self._scan_time) else STOP", "self._wanted(limits)"),
        says=("the node does not subscribe to scan, so no bad reading came to it",),
        why="a robot that sees nothing neither stops (F4, F11, I6) nor reports an obstacle (F7)",
    ),
    _edit(
        "hard_codes_the_lidars_limits",
        "F6 F12",
        "The lidar's limits are two numbers in the code.",
        (_SCANS, "in_range = scan.range_min <= distance <= scan.range_max", "in_range = 0.15 <= distance <= 12.0"),
        says=("scans full of: below range_min",),
        why="both nodes use the same function",
    ),
    _edit(
        "excludes_the_range_limits",
        "F6 F12",
        "A reading of exactly range_min or range_max does not count.",
        (_SCANS, "in_range = scan.range_min <= distance <= scan.range_max",
         "in_range = scan.range_min < distance < scan.range_max"),
        says=("the limits themselves are valid",),
        why="both nodes use the same function",
    ),
    # -- F7 -------------------------------------------------------------------------------------------------------
    _edit(
        "status_is_ok",
        "F7",
        "The status is OK instead of ACTIVE.",
        (_SPEED_SERVER, "else 'ACTIVE'", "else 'OK'"),
        says=("status 'OK'",),
    ),
    _edit(
        "never_reports_the_pose",
        "F7",
        "get_status answers with a pose of zeros.",
        (_SPEED_SERVER, "        response.pose = self._pose\n", ""),
        says=("pose (0.00, 0.00)",),
    ),
    _edit(
        "sees_what_is_beside",
        "F7",
        "What is within 90 degrees to each side counts as in the way.",
        (_SCANS, "SECTOR_HALF_WIDTH = math.radians(60.0)", "SECTOR_HALF_WIDTH = math.radians(90.0)"),
        says=("more than 60 degrees to one side",),
    ),
    _edit(
        "flag_is_about_the_front_only",
        "F7",
        "The flag in the status is about what lies ahead, in whatever direction the robot drives.",
        (_SPEED_SERVER, "motion.obstacle_in_way(self._near, self._direction(),", "motion.obstacle_in_way(self._near, 0.0,"),
        says=("True while driving backwards, away from an obstacle", "False after driving backwards"),
    ),
    _edit(
        "pose_without_a_direction",
        "F7",
        "The status gives the position of the robot without its orientation.",
        (_SPEED_SERVER, "response.pose = self._pose", "response.pose.position = self._pose.position"),
        says=("odom said", "yaw 0.00"),
    ),
    _edit(
        "status_never_clears_the_obstacle",
        "F7",
        "The flag in the status is never cleared.",
        (_SPEED_SERVER, "response.obstacle_detected = self._obstacle_in_way()",
         "self._seen = getattr(self, '_seen', False) or self._obstacle_in_way()\n"
         "        response.obstacle_detected = self._seen"),
        says=("obstacle_detected = True when the obstacle is gone",),
    ),
    _edit(
        "speed_without_a_sign",
        "F7",
        "The status gives the speed without its sign.",
        (_SPEED_SERVER, "response.speed = self._speed", "response.speed = abs(self._speed)"),
        says=("while driving backwards",),
    ),
    _edit(
        "has_its_own_status_during_a_goal",
        "F7",
        "The status says NAVIGATING while there is a goal.",
        (_NAVIGATOR, "    # On the way\n",
         "    def _on_get_status(self, request: Any, response: Any) -> Any:\n"
         "        response = super()._on_get_status(request, response)\n"
         "        if self._goal is not None:\n"
         "            response.status = 'NAVIGATING'\n"
         "        return response\n\n"
         "    # On the way\n"),
        says=("status 'NAVIGATING' on the way to a goal",),
    ),
    # -- F8 -------------------------------------------------------------------------------------------------------
    _edit(
        "refuses_a_goal_where_it_is",
        "F8",
        "A goal that is already reached is rejected.",
        (_NAVIGATOR, "        if refusal:\n            self.get_logger().warning(f'Goal",
         "        if steering.distance_to(steering.place_of(self._pose), target.x, target.y) < 0.1:\n"
         "            refusal = 'already there'\n"
         "        if refusal:\n            self.get_logger().warning(f'Goal"),
        says=("where the robot already was: it ended as rejected",),
    ),
    _edit(
        "stays_arrived",
        "F8",
        "Once arrived, every later goal counts as reached.",
        (_NAVIGATOR, "            self._goal.ending.set_result(ending)\n",
         "            self._goal.ending.set_result(ending)\n"
         "            self._arrived = ending is Ending.ARRIVED\n"),
        (_NAVIGATOR, "        elif self._is_fresh(self._odom_time) and",
         "        elif getattr(self, '_arrived', False) or self._is_fresh(self._odom_time) and"),
        says=("a target that came after others",),
    ),
    _edit(
        "serves_one_goal",
        "F8",
        "The first goal is accepted, and no other.",
        (_NAVIGATOR, "        if refusal:\n            self.get_logger().warning(f'Goal",
         "        refusal = refusal or getattr(self, '_busy', '')\n        self._busy = 'busy'\n"
         "        if refusal:\n            self.get_logger().warning(f'Goal"),
        says=("that came after others: it ended as rejected",),
    ),
    _edit(
        "stops_short",
        "F8",
        "The goal counts as reached 0.3 m before it.",
        (_STEERING, "    return distance <= min(ARRIVAL_M, ARRIVAL_SHARE * tolerance)", "    return distance <= 0.3"),
        says=("the tolerance was",),
    ),
    _edit(
        "forgets_to_say_success",
        "F8",
        "The robot arrives and the goal succeeds, but result.success is not set.",
        (_NAVIGATOR, "success=ending is Ending.ARRIVED, ", ""),
        says=("ended as succeeded with success = False",),
    ),
    _edit(
        "leaves_final_pose_empty",
        "F8",
        "The result's final_pose is never filled in.",
        (_NAVIGATOR, ", final_pose=self._pose)", ")"),
        says=("final_pose (0.00, 0.00)",),
    ),
    _edit(
        "copies_the_target_as_final_pose",
        "F8",
        "The result's final_pose is the target, wherever the robot is.",
        (_NAVIGATOR, "final_pose=self._pose)", "final_pose=handle.request.target_pose)"),
        says=("fill result.final_pose from the latest odometry, not from the target",),
    ),
    _edit(
        "claims_its_arrival",
        "F8 F9 F10 F11",
        "Every goal succeeds at once, and the robot stays where it is.",
        (_STEERING, "    if blocked:\n        return distance <= tolerance\n", "    return True\n"),
        says=("so there is no arrival to judge", "the robot never moved towards a target"),
        why="what happens on the way cannot be seen of a robot that never goes",
    ),
    _edit(
        "rolls_on_after_arrival",
        "F8 F10",
        "After a goal the robot goes on slowly.",
        (_NAVIGATOR, "            self._speed = 0.0  # or", "            self._speed = 0.05  # or"),
        says=("after the result",),
        why="the same line ends a cancelled goal (F10)",
    ),
    _edit(
        "goals_are_relative",
        "F8 F11",
        "The target is taken as relative to the robot's heading.",
        (_STEERING, "    error = normalize_angle(math.atan2(y - place.y, x - place.x) - place.yaw)\n",
         "    error = normalize_angle(math.atan2(y, x))\n"),
        says=("no result within 40 s",),
        why="it never drives where F11 blocks the way",
    ),
    # -- F9 -------------------------------------------------------------------------------------------------------
    _edit(
        "feedback_too_rarely",
        "F9",
        "Feedback comes once a second.",
        (_NAVIGATOR, "self.create_timer(self._period(", "self.create_timer(20.0 * self._period("),
        says=("feedback messages in",),
    ),
    _edit(
        "gives_no_feedback_while_turning",
        "F9",
        "Feedback comes only while the robot drives.",
        (_NAVIGATOR, "if goal is None or self._odom_time == NEVER:",
         "if goal is None or self._odom_time == NEVER or self._last_command.v == 0.0:"),
        says=("no feedback for",),
    ),
    _edit(
        "gives_no_feedback_while_blocked",
        "F9",
        "There is no feedback while something is in the way.",
        (_NAVIGATOR, "        if goal is None or self._odom_time == NEVER:\n",
         "        if goal is None or self._odom_time == NEVER or self._obstacle_in_way():\n"),
        says=("while the way was blocked",),
    ),
    _edit(
        "feedback_along_x",
        "F9",
        "The distance is measured along x alone.",
        (_NAVIGATOR, "distance_remaining=self._distance_to(goal)",
         "distance_remaining=abs(goal.x - self._pose.position.x)"),
        says=("the true distance was",),
    ),
    # -- F10 ------------------------------------------------------------------------------------------------------
    _edit(
        "refuses_to_cancel",
        "F10",
        "A cancel is refused, as rclpy does by default.",
        (_NAVIGATOR, "return CancelResponse.ACCEPT", "return CancelResponse.REJECT"),
        says=("the node refused",),
    ),
    _edit(
        "a_cancel_counts_as_success",
        "F10",
        "A cancelled goal's result says success.",
        (_NAVIGATOR, "success=ending is Ending.ARRIVED,", "success=ending is not Ending.REPLACED,"),
        says=("success = True",),
    ),
    _edit(
        "ignores_a_cancel_while_blocked",
        "F10",
        "A cancel request is looked at only while the way is free.",
        (_NAVIGATOR, "if goal.handle.is_cancel_requested:",
         "if goal.handle.is_cancel_requested and not self._obstacle_in_way():"),
        says=("while the robot waits, too",),
    ),
    _edit(
        "resumes_its_speed_after_a_goal",
        "F8 F10",
        "When a goal is over, the robot drives on at the speed that was set before it.",
        (_NAVIGATOR, "            self._speed = 0.0  # or the robot would drive off from where it was sent\n", ""),
        says=("after a goal that came after a set_speed", "forget the speed that was set before it"),
        why="the same line ends a goal that is reached (F8) and one that is cancelled (F10)",
    ),
    # -- F11 ------------------------------------------------------------------------------------------------------
    _edit(
        "gives_up_when_blocked",
        "F11",
        "A goal is aborted as soon as something is in the way.",
        (_NAVIGATOR, "        if goal.handle.is_cancel_requested:\n",
         "        if self._obstacle_in_way():\n            self._end_goal(Ending.REPLACED)\n"
         "        elif goal.handle.is_cancel_requested:\n"),
        says=("ended as aborted",),
    ),
    _edit(
        "jumps_to_the_speed",
        "F11",
        "Commands go to the wanted speed at once.",
        (_DRIVER, "self._publish(motion.speed_up_gently(self._last_command, safe, dt, limits))",
         "self._publish(safe)"),
        says=("v rose by",),
    ),
    _edit(
        "jumps_backwards",
        "F11",
        "Only forward speeds rise gently.",
        (_MOTION, "    if previous * wanted < 0.0:\n        return 0.0\n",
         "    if wanted < min(previous, 0.0) and largest_rise < 0.15:\n        return wanted\n"
         "    if previous * wanted < 0.0:\n        return 0.0\n"),
        says=("v rose by",),
    ),
    _edit(
        "jumps_after_a_stop",
        "F11",
        "After an obstacle the robot is at its full speed at once.",
        (_DRIVER, "        safe = motion.make_safe(wanted, self._near, limits)\n", ""),
        (_DRIVER, "        self._publish(motion.speed_up_gently(self._last_command, safe, dt, limits))",
         "        self._gentle = motion.speed_up_gently(\n"
         "            getattr(self, '_gentle', STOP), wanted, dt, limits)\n"
         "        self._publish(motion.make_safe(self._gentle, self._near, limits))"),
        says=("v rose by",),
    ),
    _edit(
        "turns_too_fast",
        "F11",
        "The turning speed is not limited.",
        (_MOTION, "        omega=clamp(wanted.omega, -limits.max_angular_speed, limits.max_angular_speed),\n",
         "        omega=clamp(wanted.omega, -1.9, 1.9),\n"),
        says=("omega = ",),
    ),
    # -- F12, F13 -------------------------------------------------------------------------------------------------
    _edit(
        "battery_as_a_ratio",
        "F12",
        "The battery level is published as 0 to 1.",
        (_PROCESSOR, "return clamp(FULL_PERCENT * percentage, 0.0, FULL_PERCENT)", "return clamp(percentage, 0.0, 1.0)"),
        says=("battery_level 0.",),
    ),
    _edit(
        "fuses_what_is_ahead",
        "F12",
        "The fused distance is that of the closest reading ahead.",
        (_PROCESSOR, "import closest_reading\n", "import measure_proximity\n"),
        (_PROCESSOR, "self._closest = closest_reading(scan)", "self._closest = measure_proximity(scan).ahead"),
        says=("of all beams, not only those ahead",),
    ),
    _edit(
        "logs_the_alarm_at_every_message",
        "F12",
        "A low battery is logged at every message.",
        (_PROCESSOR, "        if low and not self._battery_low:\n", "        if low:\n"),
        says=("warnings while the battery fell",),
    ),
    _edit(
        "hard_codes_the_emergency_distance",
        "Q4",
        "The emergency stop goes by 0.2 m, whatever the parameter says.",
        (_MOTION, "    if near.anywhere < limits.emergency_stop_distance:\n        return STOP\n",
         "    if near.anywhere < 0.2:\n        return STOP\n"),
        (_MOTION, "    if near.anywhere < limits.emergency_stop_distance:\n        return True\n",
         "    if near.anywhere < 0.2:\n        return True\n"),
        says=("emergency_stop_distance is declared, and its value is never used",),
    ),
    _edit(
        "hard_codes_the_safety_margin",
        "Q4",
        "How far from an obstacle the robot slows down has a limit in the code.",
        (_MOTION, "share = room / limits.safety_margin if", "share = room / 0.3 if"),
        says=("with safety_margin = 1, the robot drove on at 0.4",),
    ),
    _edit(
        "hard_codes_the_angular_acceleration",
        "Q4",
        "The robot turns up at 2 rad/s² if the parameter asks for less.",
        (_MOTION, "limits.angular_acceleration * dt", "max(2.0, limits.angular_acceleration) * dt"),
        says=("with angular_acceleration = 0.5, omega still rose as fast as with 2",),
    ),
    _edit(
        "hard_codes_the_fusion_rate",
        "Q4",
        "Feedback comes at 20 Hz, whatever the parameter says.",
        (_NAVIGATOR, "self.create_timer(self._period('fusion_rate'),", "self.create_timer(0.05,"),
        (_CONTROLLER, "self.create_timer(self._period('fusion_rate'),", "self.create_timer(0.05,"),
        says=("fusion_rate is declared, and its value is never used",),
    ),
    _edit(
        "hard_codes_the_battery_threshold",
        "F12 Q4",
        "The battery alarm goes by 20 percent, whatever the parameter says.",
        (_PROCESSOR, "percent, self._value('battery_low_threshold'))", "percent, 20.0)"),
        says=("the level fell below 30 %",),
        why="a parameter of the contract is a number in the code (Q4)",
    ),
    _edit(
        "alarms_at_any_level",
        "F12",
        "The alarms compare a ratio with percents.",
        (_PROCESSOR, "alarm_state(self._battery_low, percent,", "alarm_state(self._battery_low, battery.percentage,"),
        says=("the level fell below 30 %",),
    ),
    _edit(
        "publishes_nothing_when_nothing_is_near",
        "F12",
        "Nothing is published while no reading is valid.",
        (_PROCESSOR, "if self._closest is None:", "if self._closest is None or math.isinf(self._closest):"),
        says=("no fused data came",),
    ),
    _edit(
        "processor_crashes_without_readings",
        "F12",
        "The sensor processor crashes on the minimum of no readings.",
        (_PROCESSOR, "        self._closest = closest_reading(scan)",
         "        self._closest = min(r for r in scan.ranges if scan.range_min <= r <= scan.range_max)"),
        says=("scans with nothing in range",),
    ),
    _edit(
        "keeps_the_first_imu_message",
        "F12",
        "The IMU's first message is used for ever.",
        (_PROCESSOR, "        self._angular_velocity = imu.angular_velocity\n",
         "        if self._angular_velocity == Vector3():\n"
         "            self._angular_velocity = imu.angular_velocity\n"),
        says=("angular_velocity",),
    ),
    _edit(
        "publishes_before_the_first_scan",
        "F13",
        "Fused data come before the first scan.",
        (_PROCESSOR, "        if self._closest is None:\n            return\n",
         "        if self._closest is None:\n            self._closest = math.inf\n"),
        says=("messages before the first scan",),
    ),
    _edit(
        "stamps_with_the_scans_time",
        "F13",
        "Fused data carry the stamp of the last scan.",
        (_PROCESSOR, "        self._closest = closest_reading(scan)\n",
         "        self._closest = closest_reading(scan)\n        self._stamp = scan.header.stamp\n"),
        (_PROCESSOR, "fused.header.stamp = self.get_clock().now().to_msg()", "fused.header.stamp = self._stamp"),
        says=("a stamp of",),
    ),
    _edit(
        "fuses_at_half_the_rate",
        "F13",
        "Fused data come at half the frequency.",
        (_PROCESSOR, "        return 1.0 / self._value('fusion_frequency')", "        return 2.0 / self._value('fusion_frequency')"),
        says=("sensor_fusion_data at 10",),
    ),
    _edit(
        "fuses_at_one_and_a_half_times_the_rate",
        "F13",
        "Fused data come at 30 Hz, which a clock of 20 Hz hides.",
        (_PROCESSOR, "        return 1.0 / self._value('fusion_frequency')",
         "        return 1.0 / 1.5 / self._value('fusion_frequency')"),
        says=("sensor_fusion_data at 30",),
    ),
    # -- F14 ------------------------------------------------------------------------------------------------------
    _edit(
        "minus_pi_stays",
        "F14",
        "normalize_angle(-pi) is -pi.",
        (_CONVERSIONS, "    return math.pi if wrapped == -math.pi else wrapped\n", "    return wrapped\n"),
        says=("normalize_angle(-3.1416)",),
    ),
    _edit(
        "clamps_from_above_only",
        "F14",
        "clamp forgets the lower limit.",
        (_CONVERSIONS, "    if value < low:\n        return low\n", ""),
        says=("clamp(",),
    ),
    _edit(
        "yaw_of_a_flat_robot",
        "F14",
        "The yaw is right for a quaternion without roll and pitch.",
        (_CONVERSIONS, "    return normalize_angle(math.atan2(sine, cosine))",
         "    return normalize_angle(2.0 * math.atan2(q.z, q.w) + 0.0 * (sine + cosine))"),
        says=("yaw_from_quaternion((",),
    ),
    # -- I3, I4 ---------------------------------------------------------------------------------------------------
    _edit(
        "misnames_set_speed",
        "F2 F3 F4 F5 F6 F7 F11 I4 I6",
        "The service is called set_velocity.",
        (_SPEED_SERVER, "SetSpeed, 'set_speed'", "SetSpeed, 'set_velocity'"),
        says=("expected service set_speed (SetSpeed); found set_velocity (",),
        why="without the service the robot cannot be made to drive",
    ),
    _edit(
        "exchanges_two_fields",
        "I3",
        "SensorFusionData has the battery before the distance.",
        ("msg/SensorFusionData.msg", "float32 closest_obstacle_distance", "float32 BATTERY"),
        ("msg/SensorFusionData.msg", "float32 battery_level", "float32 closest_obstacle_distance"),
        ("msg/SensorFusionData.msg", "float32 BATTERY", "float32 battery_level"),
        says=("not in the contract's order",),
    ),
    _edit(
        "doubles_the_precision",
        "I3",
        "SensorFusionData has the distance as a float64.",
        ("msg/SensorFusionData.msg", "float32 closest_obstacle_distance", "float64 closest_obstacle_distance"),
        says=("float64",),
    ),
    _edit(
        "renames_a_field",
        "I3",
        "SensorFusionData calls the battery `battery`.",
        ("msg/SensorFusionData.msg", "float32 battery_level", "float32 battery"),
        (_PROCESSOR, "fused.battery_level = self._battery", "fused.battery = self._battery"),
        says=("`float32 battery` should be `float32 battery_level`",),
    ),
    _edit(
        "publishes_another_topic",
        "F13 I4",
        "The distance is published as `distance`.",
        (_PROCESSOR, "self.create_publisher(Float32, 'obstacle_distance', 10)", "self.create_publisher(Float32, 'distance', 10)"),
        says=("expected a publisher of obstacle_distance", "distance"),
        why="F13 asks for the rate of that topic",
    ),
    _edit(
        "deaf_to_best_effort",
        "I4",
        "The scan is subscribed reliably.",
        (_DRIVER, "self.create_subscription(LaserScan, 'scan', self._on_scan, qos_profile_sensor_data)",
         "self.create_subscription(LaserScan, 'scan', self._on_scan, 10)"),
        says=("receive nothing from best-effort publishers",),
    ),
    _edit(
        "has_absolute_names",
        "I4 I5",
        "Topics and a service are named from the root.",
        (_DRIVER, "LaserScan, 'scan', self._on_scan", "LaserScan, '/scan', self._on_scan"),
        (_DRIVER, "(Twist, 'cmd_vel', 10)", "(Twist, '/cmd_vel', 10)"),
        (_SPEED_SERVER, "SetSpeed, 'set_speed'", "SetSpeed, '/set_speed'"),
        says=("in the namespace /robot7 there is still /cmd_vel", "the node still has /cmd_vel"),
        why="a launch file cannot remap what is not in its namespace (I5)",
    ),
    # -- I5 -------------------------------------------------------------------------------------------------------
    _edit(
        "launches_two_controllers",
        "I5",
        "The launch file starts the controller twice and the processor never.",
        (_LAUNCH, "            executable='sensor_processor',\n            name='sensor_processor',",
         "            executable='robot_controller',\n            name='second_controller',"),
        says=("robot_controller_launch.py started robot_controller, second_controller",),
    ),
    _edit(
        "sets_the_parameters_in_the_launch_file",
        "I5",
        "The YAML file exists, but the launch file does not use it.",
        (_LAUNCH, "parameters=[PathJoinSubstitution([*config, 'robot_params.yaml']), use_sim_time]",
         "parameters=[{'max_linear_speed': 0.5}, use_sim_time]"),
        says=("max_linear_speed was 0.375 in the file and 0.5 in robot_controller",),
    ),
    _edit(
        "does_not_pass_on_use_sim_time",
        "I5",
        "The second launch file declares use_sim_time and does not pass it to the node.",
        ("launch/sensor_processor_launch.py", "            {'use_sim_time': LaunchConfiguration('use_sim_time')},\n", ""),
        says=("left sensor_processor with use_sim_time = False",),
    ),
    _edit(
        "does_not_declare_use_sim_time",
        "I5",
        "The second launch file reads use_sim_time without declaring it.",
        ("launch/sensor_processor_launch.py",
         "        DeclareLaunchArgument('use_sim_time', default_value='false',\n"
         "                              description='Follow /clock, as in a simulator.'),\n", ""),
        says=("lists no use_sim_time for sensor_processor_launch.py",),
    ),
    _edit(
        "needs_an_argument",
        "I5",
        "The second launch file does not start without an argument.",
        ("launch/sensor_processor_launch.py", "'raw_scan', default_value='raw_scan',", "'raw_scan',"),
        says=("missing required argument 'raw_scan'",),
    ),
    _edit(
        "needs_its_only_argument",
        "I5",
        "The first launch file declares use_sim_time without a default.",
        (_LAUNCH, "'use_sim_time', default_value='false',", "'use_sim_time',"),
        says=("without any argument, robot_controller_launch.py started",),
    ),
    _edit(
        "always_simulated_time",
        "I5",
        "A launch file sets use_sim_time whatever its argument says.",
        (_LAUNCH, "{'use_sim_time': LaunchConfiguration('use_sim_time')}", "{'use_sim_time': True}"),
        says=("use_sim_time:=false left robot_controller with use_sim_time = True",),
    ),
    _edit(
        "names_another_node_in_the_file",
        "I5 I6",
        "The key in the parameter file is not the name of a node.",
        ("config/sensor_params.yaml", "/**/sensor_processor:", "sensor_processor_node:"),
        says=("battery_low_threshold was 30.0 in the file and 20.0 in sensor_processor",),
        why="the file reaches the node neither from a launch file (I5) nor by itself (I6)",
    ),
    _edit(
        "pins_a_topic_name",
        "I5",
        "The node has its own remapping rule for the scan, which overrides those of a launch file.",
        (_DRIVER, "super().__init__('robot_controller', **node_options)",
         "super().__init__(\n            'robot_controller', cli_args=['--ros-args', '-r', 'scan:=scan'], **node_options)"),
        says=("with scan remapped to front/scan, the node still has scan",),
    ),
    # -- I6, I7, I8 -----------------------------------------------------------------------------------------------
    _edit(
        "checks_after_declaring",
        "I6",
        "The parameter callback is registered too late to see the values of the start.",
        (_SETTINGS, "    node.add_on_set_parameters_callback(check)\n    for parameter, setting in settings.items():\n"
         "        node.declare_parameter(parameter, setting.default)\n",
         "    for parameter, setting in settings.items():\n"
         "        node.declare_parameter(parameter, setting.default)\n    node.add_on_set_parameters_callback(check)\n"),
        says=("the node started with max_linear_speed = -1",),
    ),
    _edit(
        "accepts_a_negative_threshold",
        "I6",
        "One parameter accepts any value.",
        (_PROCESSOR, "'battery_low_threshold': settings.percentage(20.0)",
         "'battery_low_threshold': settings.Setting(20.0, lambda _: True, '')"),
        says=("accepted: battery_low_threshold := -5.0",),
    ),
    _edit(
        "ignores_the_threshold",
        "I6",
        "The obstacle threshold is a number in the code.",
        (_MOTION, "    return clearance(near, v) < limits.obstacle_detection_threshold\n",
         "    return clearance(near, v) < 0.5\n"),
        says=("the robot drove on with an obstacle",),
    ),
    _edit(
        "stops_by_a_number_slows_by_the_parameter",
        "I6",
        "The robot slows down before the threshold, to a crawl, and stops at a number in the code.",
        (_MOTION, "    return clearance(near, v) < limits.obstacle_detection_threshold\n",
         "    return clearance(near, v) < 0.5\n"),
        (_MOTION, "MIN_SPEED_SHARE = 0.2", "MIN_SPEED_SHARE = 0.1"),
        says=("the robot drove on with an obstacle",),
    ),
    _edit(
        "uses_wall_time",
        "I7",
        "The control timer uses a steady clock.",
        (_DRIVER, "                                                self._control)\n",
         "                                                self._control, clock=STEADY)\n"),
        (_DRIVER, "NEVER = -math.inf", "from rclpy.clock import Clock, ClockType\n\n"
         "STEADY = Clock(clock_type=ClockType.STEADY_TIME)\nNEVER = -math.inf"),
        says=("while the clock is stopped",),
    ),
    _edit(
        "stamps_with_wall_time",
        "F13 I7",
        "The fused data are stamped with the system's time.",
        (_PROCESSOR, "fused.header.stamp = self.get_clock().now().to_msg()",
         "from rclpy.clock import Clock\n        fused.header.stamp = Clock().now().to_msg()"),
        says=("a stamp of",),
        why="F13 asks for the same stamp",
    ),
    _edit(
        "drives_on_after_ctrl_c",
        "I8",
        "The robot is not stopped when the node ends.",
        (_RUNNING, "    if hasattr(node, 'stop'):\n        node.stop()\n", ""),
        says=("the last cmd_vel was",),
    ),
    _edit(
        "ends_with_a_traceback",
        "I8",
        "The node does not handle Ctrl-C.",
        (_RUNNING, "        signal.signal(number, lambda *_: asked_to_stop.set())", "        number.name"),
        says=("a traceback after SIGINT",),
    ),
    _edit(
        "crashes_when_asked_to_drive",
        "F2 F3 F4 F5 F6 F7 F11 I6 I7 I8",
        "The controller kills itself as soon as it is asked to drive.",
        (_SPEED_SERVER, "            self._speed = clamp(request.speed, -limit, limit)\n",
         "            import os\n            os.kill(os.getpid(), 9)\n"),
        says=("the node ended at", "exit status -9"),
        why="every trial that drives by set_speed ends there",
    ),
    # -- I2 -------------------------------------------------------------------------------------------------------
    _edit(
        "has_a_package_xml_of_format_2",
        "I2",
        "package.xml is of format 2, which has no groups.",
        (_PACKAGE_XML, '<package format="3">', '<package format="2">'),
        (_PACKAGE_XML, "  <member_of_group>rosidl_interface_packages</member_of_group>\n", ""),
        says=(r'it is format \"2\"',),
    ),
    _edit(
        "writes_out_its_licence",
        "I2",
        "The licence is named in words.",
        (_PACKAGE_XML, "<license>Apache-2.0</license>", "<license>Apache License, Version 2.0</license>"),
        says=("Apache License, Version 2.0",),
    ),
    _edit(
        "calls_itself_ament_python",
        "F1 F2 F3 F4 F5 F6 F7 F8 F9 F10 F11 F12 F13 I1 I2 I3 I4 I5 I6 I7 I8",
        "The build type is that of a package without CMake.",
        (_PACKAGE_XML, "<build_type>ament_cmake</build_type>", "<build_type>ament_python</build_type>"),
        says=("<build_type> is ament_python",),
        why="colcon then ignores CMakeLists.txt, so the interfaces and executables are not installed",
    ),
    _edit(
        "does_not_declare_nav_msgs",
        "I2",
        "The package subscribes to Odometry and does not depend on nav_msgs.",
        (_PACKAGE_XML, "  <exec_depend>nav_msgs</exec_depend>\n", ""),
        says=("nav_msgs (used in",),
    ),
    # -- Q --------------------------------------------------------------------------------------------------------
    _edit(
        "leaves_an_import_behind",
        "Q1",
        "A module imports something that it does not use.",
        (_CONVERSIONS, "import math\n", "import math\nimport os\n"),
        says=("F401",),
    ),
    _edit(
        "does_not_document_its_settings",
        "Q2",
        "The class and the functions of utils/settings.py have no docstrings.",
        (_SETTINGS, '    """A parameter: its default, and what its values must be, as a test and in words."""\n\n', ""),
        *((_SETTINGS, f'    """{line}"""\n', "") for line in (
            "Return a setting for a size that may be zero: a distance, a speed limit.",
            "Return a setting for a size that must not be zero: an acceleration.",
            "Return a setting for a rate in Hz.", "Return a setting for a share in percent.",
            "Return a setting for a name.",
            "Return why these values are not accepted, empty if they are; others' parameters pass.")),
        says=("53 of 60 have a docstring",),
    ),
    _edit(
        "breaks_the_docstring_rules",
        "Q2",
        "A docstring's first line is not an imperative and has no full stop.",
        (_CONVERSIONS, 'Return the unit quaternion of a rotation by `yaw` radians about z."""',
         'Returns the unit quaternion of a rotation by `yaw` radians about z"""'),
        says=("D400",),
    ),
    _edit(
        "forgets_the_test_results",
        "Q3 Q6",
        "test_results.xml is not handed in.",
        removes=("test_results.xml",),
        says=("missing: test_results.xml", "there is no test_results.xml"),
        why="the file is part of the layout (Q3), and a requirement of its own asks for it (Q6)",
    ),
    _edit(
        "decides_everything_in_one_function",
        "Q3",
        "One function has a cyclomatic complexity of 11.",
        (_CONVERSIONS, "def clamp(", "def compass_point(yaw: float) -> str:\n"
         '    """Return the point of the compass that a robot with this yaw faces."""\n'
         + "".join(f"    if yaw < {bound}:\n        return '{point}'\n" for bound, point in (
             ("-2.75", "W"), ("-1.96", "SW"), ("-1.18", "S"), ("-0.39", "SE"), ("0.39", "E"), ("1.18", "NE"),
             ("1.96", "N"), ("2.75", "NW"), ("3.15", "W"), ("math.inf", "?")))
         + "    return ''\n\n\ndef clamp("),
        says=("'compass_point' is too complex (11)",),
    ),
    _edit(
        "wraps_an_angle_by_hand",
        "Q3",
        "An angle is normalized without the function of utils/conversions.py.",
        (_STEERING, "    error = normalize_angle(math.atan2(y - place.y, x - place.x) - place.yaw)\n",
         "    error = math.atan2(y - place.y, x - place.x) - place.yaw\n"
         "    error = math.atan2(math.sin(error), math.cos(error))\n"),
        (_STEERING, "import normalize_angle, yaw_from_quaternion", "import yaw_from_quaternion"),
        says=("by hand",),
    ),
    _edit(
        "copies_a_block",
        "Q3",
        "A function is copied into the module that uses it, instead of imported.",
        (_MOTION, "def ramp(", "def held(value: float, low: float, high: float) -> float:\n"
         '    """Return `value` within its limits."""\n'
         "    lowest = min(low, high)\n    highest = max(low, high)\n"
         "    if value < lowest:\n        return lowest\n    if value > highest:\n        return highest\n"
         "    return value\n\n\ndef ramp("),
        (_STEERING, "def place_of(", "def held(value: float, low: float, high: float) -> float:\n"
         '    """Return `value` within its limits."""\n'
         "    lowest = min(low, high)\n    highest = max(low, high)\n"
         "    if value < lowest:\n        return lowest\n    if value > highest:\n        return highest\n"
         "    return value\n\n\ndef place_of("),
        says=("more than once",),
    ),
    _edit(
        "prints_its_answers",
        "Q4",
        "The node prints instead of logging.",
        (_SPEED_SERVER, """self.get_logger().info(f"{self._value('robot_name')}: {response.message}")""",
         """print(f"{self._value('robot_name')}: {response.message}")"""),
        says=("speed_server.py:",),
    ),
    _edit(
        "sleeps_in_a_callback",
        "Q4",
        "The callback of get_status waits for a hundredth of a second.",
        (_SPEED_SERVER, "import math\nfrom typing", "import math\nimport time\nfrom typing"),
        (_SPEED_SERVER, "        response.speed = self._speed\n",
         "        time.sleep(0.01)\n        response.speed = self._speed\n"),
        says=("time.sleep",),
    ),
    _edit(
        "leaves_the_types_out",
        "Q4",
        "A public function has no annotations.",
        (_CONVERSIONS, "def clamp(value: float, low: float, high: float) -> float:", "def clamp(value, low, high):"),
        says=("function clamp: ",),
    ),
    _edit(
        "does_not_say_how_to_test_it",
        "Q5",
        "The README leaves the tests out.",
        (_README, "    python3 -m pytest test\n\n`test_results.xml` is the report of such a run "
         "(`python3 -m pytest test --junitxml=test_results.xml`).\n", "Run the tests.\n"),
        says=("how to test it",),
    ),
    _edit(
        "lists_an_old_type",
        "Q5",
        "The README's table gives cmd_vel a type that it no longer has.",
        (_README, "`cmd_vel` | `geometry_msgs/msg/Twist` |", "`cmd_vel` | `geometry_msgs/msg/TwistStamped` |"),
        says=("robot_controller: publisher cmd_vel (Twist)",),
    ),
    _edit(
        "demonstrates_no_goal",
        "Q6",
        "The demonstration leaves the action out.",
        (_DEMO, "        handle = self.send_goal(self.place_ahead())\n"
         "        self.get_logger().info(f'navigate_to_position: {self.finish(handle)}')\n", ""),
        says=("it sent no goal",),
    ),
    # -- T --------------------------------------------------------------------------------------------------------
    _edit(
        "tests_its_conversions_only",
        "Q3 Q6 T1 T2 T3",
        "The only tests are those of utils/conversions.py.",
        removes=tuple(f"test/test_{tested}.py" for tested in (
            "layers", "motion", "robot_controller", "running", "scans", "sensor_processor", "settings", "speed_server",
            "steering")),
        says=("no test that asserts something runs code of robot_controller or sensor_processor",),
        why="the files belong to the layout (Q3) and to the report of the tests (Q6), and the nodes are not covered (T2, T3)",
    ),
    _edit(
        "tests_without_asserting",
        "T1",
        "A test calls a function and asserts nothing.",
        ("test/test_speed_server.py", "    assert speed_refusal(speed, 0.5) == ''\n", "    speed_refusal(speed, 0.5)\n"),
        says=("tests assert nothing",),
    ),
    _edit(
        "has_a_failing_test",
        "T1",
        "A test expects the wrong number.",
        ("test/test_scans.py", "range_min=0.0, range_max=12.0)) == 1.0", "range_min=0.0, range_max=12.0)) == 2.0"),
        says=("tests passed",),
    ),
)  # fmt: skip

EDITS = {edit.name: edit for edit in _EDITS}
