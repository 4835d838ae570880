"""Which key of package.xml stands for what the code names. Pure, and light: the checks use it too."""

from __future__ import annotations

import re
from collections.abc import Sequence

# What a name in code is called among rosdep's keys, where taking "python3-" away does not tell.
_ALSO = {
    "yaml": ("pyyaml",),
    "cv2": ("opencv", "libopencv-dev", "cv-bridge", "vision-opencv"),
    "PIL": ("pil", "pillow"),
    "serial": ("pyserial",),
    "sklearn": ("sklearn", "scikit-learn"),
    "skimage": ("skimage", "scikit-image"),
    "usb": ("usb", "pyusb"),
    "pkg_resources": ("pkg-resources", "setuptools"),
    # A package's linter tests are also declared by the two that bring all linters.
    "ament_copyright": ("ament-lint-common", "ament-lint-auto", "ament-cmake-copyright"),
    "ament_flake8": ("ament-lint-common", "ament-lint-auto", "ament-cmake-flake8"),
    "ament_pep257": ("ament-lint-common", "ament-lint-auto", "ament-cmake-pep257"),
    "pytest": ("ament-cmake-pytest",),
}


def is_declared(name: str, declared: Sequence[str]) -> bool:
    """Return whether one of the `declared` keys stands for the package or module `name`: numpy is python3-numpy."""
    wanted = {_key(name), *_ALSO.get(name, ())}
    return bool(wanted & {_key(other) for other in declared})


def _key(name: str) -> str:
    plain = name.lower().replace("_", "-")
    return re.sub(r"^python3?-|-pip$", "", plain)
