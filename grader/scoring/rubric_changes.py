"""Change the kit's rubric by one that has `extends: kit` at its top, and below it only what differs.

What it writes takes the place of what the kit's has under the same keys and ids, `dropped` names what is not graded,
and what the kit's has not is added. Points that are not typed are sums, so nothing has to be added up again.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import yaml

from grader import yaml_reader
from grader.yaml_reader import YamlReader

# What has ids, and what a new one needs: without it an id is meant that the kit's rubric has.
_LISTED = {"criteria": ("title", "levels", "requirements"), "requirements": ("text", "checks"), "checks": ("points",)}
_SUMS = ("points", "advanced")


def changed(base: yaml.Node, path: Path, changes: yaml.Node) -> yaml.Node:
    """Return the rubric `base` with the changes that are in `path`, as nodes.

    Raises:
        GraderError: the changes are about something that `base` has not.
    """
    reader = _Changes(path, base, yaml_reader.value(changes, "dropped"))
    return reader.merged(reader.rest, changes)


class _Changes(YamlReader):
    """Walks two rubrics at once. `rest` is what is left of the first one, `_homes` what each id in it is part of."""

    def __init__(self, path: Path, base: yaml.Node, dropped: yaml.Node | None) -> None:
        super().__init__(path)
        self._dropped: dict[str, yaml.Node] = {}
        known = [name for _, _, name in _ids(base)]
        for item in self.items(dropped) if dropped else ():
            self.require_known(self.text(item), item, known, "in the kit's rubric")
            self._dropped[self.text(item)] = item
        self.rest = self._rest(base)
        self._homes = {name: (kind, home) for kind, home, name in _ids(self.rest)}

    def _rest(self, node: yaml.Node, kind: str = "", home: str = "") -> yaml.Node:
        """Return a node without what is dropped, and without typed sums."""
        if isinstance(node, yaml.MappingNode):
            summed = _SUMS if any(key.value in _LISTED for key, _ in node.value) else ()
            pairs = [(key, value) for key, value in node.value if key.value not in summed]
            kept = [(key, self._rest(value, key.value, _id(node))) for key, value in pairs]
            return yaml.MappingNode(node.tag, kept, node.start_mark, node.end_mark)
        if isinstance(node, yaml.SequenceNode) and kind in _LISTED:
            items = [self._rest(item) for item in node.value if _id(item) not in self._dropped]
            if not items:
                self.fail(self._dropped[_id(node.value[-1])], f"nothing is left of {home}; drop it as a whole")
            return yaml.SequenceNode(node.tag, items, node.start_mark, node.end_mark)
        return node

    def merged(self, old: yaml.Node, new: yaml.Node, kind: str = "", home: str = "") -> yaml.Node:
        """Return `new` in place of `old`; of mappings key by key, of what has ids item by item."""
        if isinstance(old, yaml.MappingNode) and isinstance(new, yaml.MappingNode):
            given = {name: (key, value) for name, key, value in self.mapping(new) if name != "extends"}
            home = _id(new)
            kept = [
                (given[key.value][0], self.merged(value, given.pop(key.value)[1], key.value, home))
                if key.value in given
                else (key, value)
                for key, value in old.value
            ]
            return yaml.MappingNode(new.tag, [*kept, *given.values()], new.start_mark, new.end_mark)
        if kind in _LISTED and isinstance(old, yaml.SequenceNode):
            items = {_id(item): item for item in old.value}
            seen: set[str] = set()
            for item in self.items(new):
                name = self._known(item, kind, home)
                if name in seen:
                    self.fail(item, f"{name} is written twice; join the two")
                seen.add(name)
                items[name] = self.merged(items.get(name, item), item)
            return yaml.SequenceNode(new.tag, [*items.values()], new.start_mark, new.end_mark)
        return new

    def _known(self, item: yaml.Node, kind: str, home: str) -> str:
        """Return the id of an item, if the first rubric has it here, or if it is a whole new one."""
        keys = {key for key, _, _ in self.mapping(item)}
        if "id" not in keys:
            self.fail(item, "'id' is missing")
        name, needed = _id(item), _LISTED[kind]
        if name in self._homes and self._homes[name] != (kind, home):
            self.fail(item, f"the kit's rubric has {name} in {self._homes[name][1]}; write it there")
        if name in self._homes and "held_back" in keys:
            self.fail(item, f"students have the trials and checks of {name}; hold back a requirement of your own")
        if name not in self._homes and not keys >= {*needed}:
            known = [each for each, (of, _) in self._homes.items() if of == kind]
            self.require_known(name, item, known, f"in the kit's rubric, and a new one needs {' and '.join(needed)}")
        return name


def _id(node: yaml.Node) -> str:
    found = yaml_reader.value(node, "id")
    return str(found.value) if found is not None else ""


def _ids(node: yaml.Node, home: str = "") -> Iterator[tuple[str, str, str]]:
    """Yield what kind of thing has an id, in what it is, and the id."""
    for key, listed in node.value:
        for item in listed.value if key.value in _LISTED else ():
            yield key.value, home, _id(item)
            yield from _ids(item, _id(item))
