# SPDX-License-Identifier: BSD-3-Clause
# Of the Python client; called by catkin only. pip builds cuboid_map, of pyproject.toml.
from distutils.core import setup

from catkin_pkg.python_setup import generate_distutils_setup

try:
    from setuptools.dist import Distribution
    parse = Distribution.parse_config_files
    # Without pyproject.toml, whose name is that of the other package.
    Distribution.parse_config_files = lambda self, filenames=None, *more, **options: parse(self, filenames or [], *more, **options)
except ImportError:
    pass  # distutils alone does not read it.

setup(**generate_distutils_setup(
    packages=['cuboid_mapping_client'], package_dir={'': 'python'}))
