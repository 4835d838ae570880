"""Any input at all: what students hand in is read or refused in words, never with a traceback of ours."""

# ruff: noqa: E501 - lists of words, as dense as they can be read

from __future__ import annotations

import contextlib
import json
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from helpers import course as spec
from helpers.course import COURSE
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from grader import evidence
from grader.building import install_tree
from grader.intake.package_xml import read_package_xml
from grader.quality import worker
from grader.student_tests import worker_report
from grader.trials import parameter_files
from sim.world import WorldError, load_world

pytestmark = pytest.mark.slow  # the same with other seeds; intake/test_any_input.py is quick

MANY = 1300  # of each of seven readers


@contextlib.contextmanager
def written(name: str, data: bytes | str):
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, name)
        path.write_bytes(data if isinstance(data, bytes) else data.encode("utf-8", "surrogatepass"))
        yield path


def pieces(*words: str, most: int = 14) -> st.SearchStrategy[str]:
    """Texts made of words that mean something to a reader, and of anything."""
    return st.lists(st.sampled_from(words) | st.text(max_size=5), max_size=most).map("".join)


# -- XML ----------------------------------------------------------------------------------------------------------

XML = pieces(
    "<?xml version='1.0'?>", "<?xml version='1.0' encoding='utf-16'?>", "<package format='3'>", "</package>", "<name>",
    "</name>", "<license>", "</license>", "<!DOCTYPE a [<!ENTITY b 'c'>]>", "&b;", "&#0;", "<export><build_type>",
    "</build_type></export>", "<![CDATA[", "]]>", "<!--", "-->", "<depend>rclpy</depend>", "<a b='", "'/>", "\x00", "\ufeff",
    "<testsuites>", "</testsuites>", "<testsuite>", "</testsuite>", "<testcase name='a' classname='b'/>", "<failure/>",
)  # fmt: skip


def package_xml(data: bytes | str) -> None:
    with written("package.xml", data) as path:
        assert read_package_xml(path).problem.isprintable()


def results_report(data: bytes | str) -> None:
    with written(worker.NAME, data) as path:
        found = worker.read_report(path.parent, [worker.NAME])
        assert found is not None
        assert found.problem.isprintable()


# -- YAML ---------------------------------------------------------------------------------------------------------

YAML = pieces(
    "robot_controller:\n", "  ros__parameters:\n", "    max_linear_speed: ", "0.5\n", "[", "]", "{", "}", "- ", ": ", "\n",
    "  ", "&a ", "*a", "!!python/object/apply:os.system ['true']", "!!binary ", "? ", "| ", ">", "'", '"', "#", "%", "@",
    ".nan", "1e999", "0x", "2001-01-01", "<<: ", "---\n", "...\n", "\t", "null", "\u2028",
)  # fmt: skip


def parameters(data: bytes | str) -> None:
    with written("robot_params.yaml", data) as path:
        copies, values = parameter_files.write_changed(path.parent, path.parent / "out", COURSE.telltales)
        assert set(copies.values()) <= {"robot_params.yaml"}
        assert set(values) <= set(COURSE.telltales)


def world(data: bytes | str) -> None:
    with written("world.yaml", data) as path, contextlib.suppress(WorldError):
        load_world(path)


# -- what walled-in processes leave -------------------------------------------------------------------------------

JSON: st.SearchStrategy[Any] = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=8),
    lambda inner: st.lists(inner, max_size=4)
    | st.dictionaries(
        st.sampled_from(["id", "outcome", "when", "seconds", "collected", "ended", "status", "late", "tests", "reach",
                         "type_hashes", "type_name", "hash_string", "message", "broken", "refused", "where", "queued"])
        | st.text(max_size=4),
        inner,
        max_size=5,
    ),
    max_leaves=12,
)  # fmt: skip
LINES = st.lists(JSON.map(json.dumps) | st.text(max_size=20), max_size=6).map("\n".join)


def bench_files(data: str) -> None:
    with tempfile.TemporaryDirectory() as folder:
        for end in ("done", "report", "reach", "log"):
            Path(folder, f"0.{end}").write_text(data, errors="surrogatepass")
        ran = worker_report.read_run(Path(folder), 0, 1.0)
        assert all(isinstance(test.id, str) for test in ran.tests)


def type_description(data: str) -> None:
    with written("SetSpeed.json", data) as path:
        share = path.parent / spec.PACKAGE / "srv"
        share.mkdir(parents=True)
        path.rename(share / "SetSpeed.json")
        assert isinstance(install_tree.installed_hash(path.parent, spec.PACKAGE, "srv/SetSpeed"), str)


def saved_evidence(data: str) -> None:
    with contextlib.suppress(ValueError):
        evidence.from_json(data, evidence.Trial)


READERS: dict[str, tuple[st.SearchStrategy[Any], Callable[[Any], None]]] = {
    "package.xml": (XML | st.binary(max_size=80), package_xml),
    "test_results.xml": (XML | st.binary(max_size=80), results_report),
    "parameter files": (YAML | st.binary(max_size=80), parameters),
    "world files": (YAML, world),
    "the bench's files": (LINES, bench_files),
    "type descriptions": (LINES | JSON.map(json.dumps), type_description),
    "evidence": (JSON.map(json.dumps) | st.text(max_size=20), saved_evidence),
}


@pytest.mark.parametrize("name", READERS)
def test_a_thousand_inputs_are_read_or_refused(name: str):
    strategy, reader = READERS[name]
    loosened = settings(max_examples=MANY, database=None, suppress_health_check=list(HealthCheck), derandomize=True)
    loosened(given(strategy)(reader))()
