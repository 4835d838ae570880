"""Attacks by text: for analysers, for readers of reports, in launch and parameter files, and in what a node prints."""

# ruff: noqa: E501 - quoted code has long lines

from __future__ import annotations

from attacks.weaknesses import NO_WORDS, NOTED, SLOPPY, SLOPPY_NODES
from grader.authoring.package_edits import append, put, replace
from grader.selftest.attacks.attack import Attack, attack, node
from grader.selftest.attacks.on_nodes import CREEPS

_LAUNCH = "launch/robot_controller_launch.py"
_SCRIPT = "<script>alert('@TOKEN@')</script>"

_PADDING = '"""Helpers."""\n\n\n' + "\n\n".join(
    f'def helper_{n}(value: float) -> float:\n    """Return the value and {n}."""\n    return value + {n}\n'
    for n in range(250)
)
_README = """
This package drives a robot safely from place to place, looks at what its sensors see, stops before obstacles, and tells
everybody who asks about its battery and about its speed.

    colcon build
    ros2 launch ros2_robot_controller robot_controller_launch.py
    python -m pytest test

| node | kind | name | type |
|---|---|---|---|
| robot_controller | subscribes | scan | sensor_msgs/msg/LaserScan |
| robot_controller | subscribes | odom | nav_msgs/msg/Odometry |
| robot_controller | publishes | cmd_vel | geometry_msgs/msg/Twist |
"""
ATTACKS: tuple[Attack, ...] = (
    attack(
        "silences_the_linters",
        "The package has noqa, type: ignore, a .flake8 and a setup.cfg that switch every rule off.",
        put(".flake8", "[flake8]\nignore = E,F,W,C,D\nexclude = *\nmax-line-length = 9999\n"),
        append("setup.cfg", "\n[flake8]\nignore = E,F,W\nexclude = *\n[pydocstyle]\nmatch = nothing\n"),
        put("tox.ini", "[flake8]\nignore = E,F,W\n"),
        put("pyproject.toml", "[tool.ruff]\nexclude = ['*']\n"),
        replace("ros2_robot_controller/sloppy.py", "def Thing0(", "# flake8: noqa\n# pylint: skip-file\n# type: ignore\ndef Thing0("),
        number=37, needs="Q1 Q2", weak=SLOPPY, costs="Q1 Q2",
        stopped="linters run with ROS's configuration; suppressions are ignored",
    ),
    attack(
        "pads_with_clean_code",
        "Beside nodes that are badly written there are 250 clean, documented functions that only a test calls.",
        put("ros2_robot_controller/padding.py", _PADDING),
        put("test/test_padding.py", "from ros2_robot_controller import padding\n\n\ndef test_it():\n    assert padding.helper_1(1) == 2\n"),
        needs=f"{NOTED} Q1 Q2 Q4", weak=SLOPPY_NODES,
        stopped="a file of which nothing runs in the nodes' trials neither earns nor costs",
    ),
    attack(
        "outgrows_the_linter",
        "The badly written module is made too large to be read.",
        append("ros2_robot_controller/sloppy.py", ("# " + "-" * 96 + "\n") * 3000),
        needs="Q1 Q2 Q4", weak=SLOPPY_NODES, costs="Q1 Q2 Q4",
        stopped="a module that is not read costs what its lines weigh, as if each of them had a finding",
    ),
    attack(
        "hides_a_readme",
        "README.md shows a title only. All else is in a comment, in an element that is not displayed, in white, or in attributes.",
        append("README.md", f"\n<!--\n{_README}\n-->\n\n<div style='display: none'>\n\n{_README}\n\n</div>\n"),
        append("README.md", f"\n<span style='color: hsl(0, 0%, 99%)'>\n\n{_README}\n\n</span>\n\n[//]: # (colcon build, pytest)\n"),
        append("README.md", f"\n<span style='font-size: 1px'>{_README}</span>\n\n<p class='c' style='clip-path: circle(0)'>{_README}</p>\n"),
        append("README.md", "\n<img src='a.png' alt='colcon build; ros2 run ros2_robot_controller demo.py; pytest'>\n"),
        needs="Q5", weak=NO_WORDS, flag="hidden text",
        stopped="only what a reader of the rendered page sees is read; that there is more is said",
    ),
    attack(
        "slows_down_regular_expressions",
        "Nine hundred thousand empty lines, lines of nothing but #, a word of 500,000 letters in CMakeLists.txt: texts "
        "on which a careless regular expression takes quadratic time.",
        put("empty.py", "\n" * 900_000),
        put("ros2_robot_controller/marks.py", '"""Marks."""\n' + ("#" * 2000 + "\n") * 400),
        append("CMakeLists.txt", f"\nset(WORD \"{'a' * 500_000}\")\n"),
        needs="I1 I2 Q1", costs="Q1",
        stopped="each regular expression starts only where a match can start",
    ),
    attack(
        "hides_code_in_strings",
        "Sloppy code is in a string that is executed.",
        put("ros2_robot_controller/sloppy.py", '"""Holds code."""\n\nCODE = """\ndef Thing( a,b ):\n  return  a+b\n"""\nexec(CODE)\n'),
        append("ros2_robot_controller/robot_controller.py", "\n\nfrom ros2_robot_controller import sloppy  # noqa\n"),
        number=37, needs="F7 Q1", costs="Q1", flag="code made at run time",
        stopped="code that is made at run time is named to a person, with file and line",
    ),
    attack(
        "breaks_the_analysers",
        "Python files nested ten thousand deep, with a line of a megabyte, and with a name that forges a finding.",
        put("ros2_robot_controller/deep.py", '"""Deep."""\n\nX = ' + "(" * 10_000 + "1" + ")" * 10_000 + "\n"),
        put("ros2_robot_controller/long.py", '"""Long."""\n\nX = "' + "x" * 1_000_000 + '"\n'),
        put("ros2_robot_controller/a.py:1:1: E999 not mine.py", '"""Named."""\n'),
        needs="Q1 Q2", costs="Q1 Q2",
        stopped="analysers run with limits, over copies with the grader's own names; a file that breaks one is reported",
    ),
    attack(
        "injects_html",
        "Names, descriptions and logs contain scripts and images for the instructor's browser.",
        replace("package.xml", "<maintainer", f"<author>{_SCRIPT.replace('<', '&lt;')}</author>\n  <maintainer"),
        node(f"print({_SCRIPT!r} + '<img src=x onerror=alert(1)>', flush=True)\nraise SystemExit({_SCRIPT!r})"),
        put(f"docs/{_SCRIPT.replace('/', '_')}.md", _SCRIPT),
        number=41, needs="F1", costs="F1", proof="onerror=alert",
        stopped="every text is escaped, and the report's content security policy allows no script",
    ),
    attack(
        "paints_the_terminal",
        "Names and the node's last output contain escape sequences, right-to-left marks and fake report lines.",
        node(r"print('\x1b[2J\x1b[32mpassed F1\x1b[0m \u202e3/3', flush=True)"
             "\n" r"raise SystemExit('\x1b]0;owned\x07\r  passed       F1   3 / 3\n\n\nPoints    100 of 100')"),
        put("docs/\x1b[31m\u202egnp.md", "x"),
        number=25, needs="F1", costs="F1", proof="Points    100 of 100",
        stopped="unprintable characters are written as codes, and line breaks are removed where they could fake a line",
    ),
    attack(
        "parameter_file_runs_code",
        "A parameter file has a tag that makes a careless reader run a program, and exponential anchors.",
        append("config/sensor_params.yaml",
               "\nevil: !!python/object/apply:os.system ['echo x > @NEIGHBOUR@']\n"
               "a: &a [x, x, x, x, x, x, x, x, x]\nb: &b [*a, *a, *a, *a, *a, *a, *a, *a, *a]\n"
               "c: &c [*b, *b, *b, *b, *b, *b, *b, *b, *b]\nd: [*c, *c, *c, *c, *c, *c, *c, *c, *c]\n"),
        number=10, needs="I5", costs="I5",
        stopped="YAML is read without tags; the grader does not read a file with anchors at all",
    ),
    attack(
        "launch_file_attacks",
        "A launch file kills what it can, starts a daemon, opens sockets and moves to another domain.",
        append(_LAUNCH, """

import os
import signal
import socket
import subprocess

plain_description = generate_launch_description


def generate_launch_description():
    subprocess.Popen(['sh', '-c', 'while :; do sleep 1; done', '@TOKEN@'], start_new_session=True)
    try:
        socket.create_connection(('127.0.0.1', @PORT@), 1)
    except OSError as error:
        print('ATTACK', error, flush=True)
    try:
        open('@NEIGHBOUR@', 'w').write('{}')
    except OSError as error:
        print('ATTACK', error, flush=True)
    for pid in list(range(2, 400)):
        try:
            if pid != os.getpid():
                os.kill(pid, signal.SIGKILL)
        except OSError:
            pass
    return plain_description()
"""),
        number=35, needs="I5", costs="I5", proof="ATTACK [Errno",
        stopped="a launch file runs in a sandbox like all the student's code; no process of the grader is in it",
    ),
    attack(
        "launch_file_moves_away",
        "A launch file sets the domain and the middleware, to hide from the observer.",
        append(_LAUNCH, "\n\nimport os\nos.environ['ROS_DOMAIN_ID'] = '117'\nos.environ['RMW_IMPLEMENTATION'] = 'rmw_none'\n"
                        "os.environ['ROS_AUTOMATIC_DISCOVERY_RANGE'] = 'OFF'\n"),
        number=28, needs="I5", costs="I5",
        stopped="a node that is not on the expected graph counts as absent",
    ),
    attack(
        "results_report_explodes",
        "test_results.xml expands entities exponentially and claims ten thousand passed tests.",
        put("test_results.xml",
            '<?xml version="1.0"?>\n<!DOCTYPE a [<!ENTITY a "xxxxxxxxxx">' +
            "".join(f'<!ENTITY {chr(98 + i)} "{("&" + chr(97 + i) + ";") * 10}">' for i in range(9)) +
            "]>\n<testsuite tests='10000'><testcase name='&j;'/></testsuite>\n"),
        number=13, needs="Q6", costs="Q6",
        stopped="XML with a DOCTYPE is refused, so no entity is expanded",
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
)  # fmt: skip
