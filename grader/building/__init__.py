"""Build packages with `colcon` in the sandbox, once for each content, and read what a build installed."""

from grader.building.cache import cache_folder, checksum, content_key, toolchain_id
from grader.building.colcon import FIRST_TIME, INSTALL, Built, build, build_contract, contract_is_built
from grader.building.install_tree import interface_text, shared_file
