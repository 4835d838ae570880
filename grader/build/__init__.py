"""Build packages with `colcon` in a sandbox, once for each content, and read what a build has installed."""

from grader.build.cache import cache_folder
from grader.build.colcon import INSTALL, Built, build, contract, contract_is_built
from grader.build.install_tree import interface_text, types_package

__all__ = [
    "INSTALL",
    "Built",
    "build",
    "cache_folder",
    "contract",
    "contract_is_built",
    "interface_text",
    "types_package",
]
