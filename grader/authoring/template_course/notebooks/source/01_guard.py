# %% [markdown]
# # 01 · A guard in a hall
# You write one node: sent on patrol, it drives until the hall ends.

# %%
from grader.notebook import begin, check, run_node

begin("01")

# %% [markdown]
# ## A package
# `package.xml`, `setup.py` and `setup.cfg` are given; `guard.py` is yours.

# %% tags=["given"]
# %%writefile package.xml
<?xml version="1.0"?>
<?xml-model href="http://download.ros.org/schema/package_format3.xsd" schematypens="http://www.w3.org/2001/XMLSchema"?>
<package format="3">
  <name>hall_guard</name>
  <version>1.0.0</version>
  <description>Drives up and down a hall while it is on patrol, and stops at the end.</description>
  <maintainer email="course@example.com">ROS 2 course kit</maintainer>
  <license>Apache-2.0</license>

  <exec_depend>geometry_msgs</exec_depend>
  <exec_depend>rcl_interfaces</exec_depend>
  <exec_depend>rclpy</exec_depend>
  <exec_depend>sensor_msgs</exec_depend>
  <exec_depend>std_srvs</exec_depend>

  <test_depend>python3-pytest</test_depend>

  <export>
    <build_type>ament_python</build_type>
  </export>
</package>

# %% tags=["given"]
# %%writefile setup.py
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

# %% tags=["given"]
# %%writefile setup.cfg
[develop]
script_dir=$base/lib/hall_guard
[install]
install_scripts=$base/lib/hall_guard

# %% tags=["given"]
# %%writefile resource/hall_guard
hall_guard

# %% tags=["given"]
# %%writefile hall_guard/__init__.py
"""A guard in a hall."""

# %% tags=["given"]
# %%writefile config/guard.yaml
# Parameters of guard. The key matches the node in any namespace.
/**/guard:
  ros__parameters:
    patrol_speed: 0.25   # m/s
    stop_distance: 0.75  # m, nearer than this ahead: stand still

# %% tags=["exercise"]
# %%writefile hall_guard/guard.py
"""TODO: the guard."""

# %% [markdown]
# ## On patrol

# %% tags=["check"]
check("B1", "B2")

# %% [markdown]
# ## The end of the hall
# The simulated hall shows what your node does.

# %%
with run_node(world="hall") as run:
    print(run.patrol(True).message)
    print(f"{run.drive(14.0).x[-1]:.1f} m")

# %% tags=["check"]
check("B3")

# %% [markdown]
# ## Hand in
# `grader submit` packs the package.
