"""Build packages with `colcon` in the sandbox, once for each content, and read what a build installed."""

from grader.building.cache import cache_folder, checksum, content_key, toolchain_id
from grader.building.colcon import INSTALL, Built, build, build_contract, contract_is_built, is_built
from grader.building.install_tree import interface_text
from grader.building.package_name import places as places_of_name

__all__ = [
    "INSTALL",
    "Built",
    "build",
    "build_contract",
    "cache_folder",
    "checksum",
    "content_key",
    "contract_is_built",
    "interface_text",
    "is_built",
    "places_of_name",
    "toolchain_id",
]
