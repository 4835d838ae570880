"""Patrol, and dock."""

# rosidl generates msg, srv and action into a package of this very name. In the source tree they
# lie elsewhere, so let Python look in every folder of this name on its path.
__path__ = __import__('pkgutil').extend_path(__path__, __name__)
