"""Which key in package.xml declares a package or module that the code names."""

from __future__ import annotations

import re
from collections.abc import Sequence

# Names in code whose rosdep keys are more than "python3-" and the name.
_ALSO = {
    "yaml": ("pyyaml",),
    "cv2": ("opencv", "libopencv-dev", "cv-bridge", "vision-opencv"),
    "PIL": ("pil", "pillow"),
    "serial": ("pyserial",),
    "sklearn": ("sklearn", "scikit-learn"),
    "skimage": ("skimage", "scikit-image"),
    "usb": ("usb", "pyusb"),
    "pkg_resources": ("pkg-resources", "setuptools"),
    # A package's linter tests may also be declared by the two packages that bring all linters.
    "ament_copyright": ("ament-lint-common", "ament-lint-auto", "ament-cmake-copyright"),
    "ament_flake8": ("ament-lint-common", "ament-lint-auto", "ament-cmake-flake8"),
    "ament_pep257": ("ament-lint-common", "ament-lint-auto", "ament-cmake-pep257"),
    "pytest": ("ament-cmake-pytest",),
    # ROS's tutorial on launch files declares the command, which depends on both.
    "launch": ("ros2launch",),
    "launch_ros": ("ros2launch",),
}


def is_declared(name: str, declared: Sequence[str], packages: Sequence[str] = ()) -> bool:
    """Return whether one of the `declared` keys declares the package or module `name`: python3-numpy does numpy.

    `packages` are those of pip that have the module, where they have other names.
    """
    wanted = {_key(name), *_ALSO.get(name, ()), *map(_key, packages)}
    return bool(wanted & {_key(other) for other in declared})


def _key(name: str) -> str:
    return re.sub(r"^python3?-|-pip$", "", name.lower().replace("_", "-"))
