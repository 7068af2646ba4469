# SPDX-License-Identifier: BSD-3-Clause
# Of the Python client; called by catkin only. pip builds cuboid_map, of pyproject.toml.
from distutils.core import setup

from catkin_pkg.python_setup import generate_distutils_setup

setup(**generate_distutils_setup(
    packages=['cuboid_mapping_client'], package_dir={'': 'python'},
    src_root='python'))  # Where setuptools looks for a pyproject.toml: not here.
