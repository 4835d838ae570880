"""Install the package for ROS: its module, its node and its parameter file."""

from setuptools import find_packages, setup

package_name = 'hall_guard'

setup(
    name=package_name,
    version='1.0.0',
    packages=find_packages(exclude=['test']),
    data_files=[
        ('share/ament_index/resource_index/packages', ['resource/' + package_name]),
        ('share/' + package_name, ['package.xml']),
        ('share/' + package_name + '/config', ['config/guard.yaml']),
    ],
    install_requires=['setuptools'],
    zip_safe=True,
    entry_points={'console_scripts': ['guard = hall_guard.guard:main']},
)
