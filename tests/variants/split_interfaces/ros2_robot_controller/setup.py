"""Build the package with ament_python."""

from glob import glob

from setuptools import find_packages, setup

NAME = 'ros2_robot_controller'

setup(
    name=NAME,
    version='1.0.0',
    packages=find_packages(exclude=['test']),
    data_files=[
        ('share/ament_index/resource_index/packages', ['resource/' + NAME]),
        ('share/' + NAME, ['package.xml']),
        ('share/' + NAME + '/launch', glob('launch/*_launch.py')),
        ('share/' + NAME + '/config', glob('config/*.yaml')),
    ],
    install_requires=['setuptools'],
    zip_safe=True,
    maintainer='ROS 2 course kit',
    maintainer_email='course@example.com',
    description='Drives a robot safely.',
    license='Apache-2.0',
    entry_points={
        'console_scripts': [
            'robot_controller = ros2_robot_controller.robot_controller:main',
            'sensor_processor = ros2_robot_controller.sensor_processor:main',
        ],
    },
)
