"""I2: package.xml, compared with the package."""

from grader.checks.judge import Failed, Judge, NotReached
from grader.course import packages
from grader.evidence import Manifest
from grader.words import mark, say, some

NEEDS = ("quality",)


def test_package_xml_is_valid_format_3(judge: Judge) -> None:
    """package.xml is valid format 3, with a maintainer who can be reached."""
    manifest = _manifest(judge)
    wrong = list(manifest.problems)
    if manifest.format != "3":
        wrong.append(say('its format is "{manifest.format}", not "3"', manifest=manifest))
    if manifest.placeholders:
        names = some(manifest.placeholders, 3)
        wrong.append(say("the maintainer is a placeholder: {placeholders}", placeholders=names))
    if wrong:
        share = 0.0 if manifest.problems else 1 - 0.5 * len(wrong)
        try_ = say("compare it with the course's line by line; the maintainer is you, where mail reaches you")
        judge.share(share, "\n".join(wrong), try_)


def test_licence_has_its_spdx_name(judge: Judge) -> None:
    """The licence is named by its SPDX identifier."""
    manifest = _read_manifest(judge)
    try_ = say("for example <license>Apache-2.0</license>")
    judge.expect(bool(manifest.licences), say("package.xml does not name a licence"), try_)
    bad = [name for name, known in zip(manifest.licences, manifest.spdx, strict=True) if not known]
    seen = say("not an SPDX identifier: {bad}", bad=some(bad, 5))
    judge.expect(not bad, seen, say("look it up at spdx.org/licenses: Apache-2.0, MIT"))


def test_build_type_matches_the_package(judge: Judge) -> None:
    """The build type is the one that the package really has."""
    manifest = _read_manifest(judge)
    real = "ament_cmake" if manifest.has_cmake else "ament_python"
    because = say("there is a CMakeLists.txt") if manifest.has_cmake else say("there is no CMakeLists.txt")
    said = say("package.xml names no build type")
    if manifest.build_type:
        said = say("<build_type> is {manifest.build_type}", manifest=manifest)
    installed = all(map(judge.is_installed, judge.course.nodes))
    if manifest.has_cmake and manifest.build_type == "ament_python" and installed:
        seen = say("<build_type> is ament_python, by which it was built; beside it is a CMakeLists.txt")
        raise Failed(seen, say("delete CMakeLists.txt, by which nothing is built"))
    try_ = say("<export><build_type>{real}</build_type></export>, as the last element of <package>", real=real)
    judge.expect(manifest.build_type == real, say("{said}, and {because}", said=said, because=because), try_)


def test_every_package_used_is_declared(judge: Judge) -> None:
    """Every package that the package uses is declared; each missing one costs a fifth."""
    manifest = _read_manifest(judge)
    missing = []
    for name, places in manifest.used.items():
        if not packages.is_declared(name, manifest.declared):
            missing.append(say("{name} (used in {places})", name=name, places=some(places, 2)))
        elif not packages.is_declared(name, manifest.declared_to_run) and (running := _runs(places)):
            words = mark("{name} (used in {running}, and declared for tests only)")
            missing.append(say(words, name=name, running=some(running, 2)))
    if missing:
        seen = say("not declared:\n") + "\n".join(missing)
        try_ = say("<depend>name</depend>; a pip module is python3-name (see rosdep's keys)")
        judge.share(1 - len(missing) / 5, seen, try_)


def _runs(places: list[str]) -> list[str]:
    """Return the places in Python code that runs with the nodes; CMake may need a package for tests only."""
    python = [place for place in places if place.rpartition(":")[0].endswith(".py")]
    return [place for place in python if not place.startswith(("test/", "tests/"))]


def _manifest(judge: Judge) -> Manifest:
    manifest = judge.quality().manifest
    judge.expect(manifest.found, say("there is no package.xml"), say("write one: it makes a folder a ROS package"))
    return manifest


def _read_manifest(judge: Judge) -> Manifest:
    """Return the facts of a package.xml that could be read; of another, nothing more is known."""
    manifest = _manifest(judge)
    if manifest.problems and not manifest.format:
        raise NotReached(manifest.problems[0])
    return manifest
