"""Let plain Python tools find the modules. ROS builds the package with CMakeLists.txt."""

from setuptools import find_packages, setup

setup(
    name='ros2_robot_controller',
    version='1.0.0',
    packages=find_packages(exclude=['test']),
)
