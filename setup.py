"""Installs the package with colcon (ament_python) and with pip alike.

The metadata is here and not in a [project] table of pyproject.toml because colcon reads setup.py.
rclpy and the message packages come from ROS (see package.xml) and are no names on PyPI.
"""

import os
import runpy

from setuptools import Distribution, find_packages, setup

PACKAGE = "gameinfer_ros"
NODES = runpy.run_path(f"{PACKAGE}/nodes/table.py")["NODES"]

CONSOLE_SCRIPTS = {
    "gameinfer": f"{PACKAGE}.commands.gameinfer:command",
    **{name: f"{PACKAGE}.commands.executables:{name}" for name in ("orchestrator", *NODES)},
}

SHARED_FILES = [
    (f"share/{PACKAGE}/{folder}", [os.path.join(folder, name) for name in sorted(names)])
    for top in ("config", "examples")
    for folder, _, names in os.walk(top)
    if not folder.endswith("__pycache__")
]

HAND_OVER = """\
#!/bin/sh
# `ros2 run` looks in lib/<package>, but pip puts console scripts into bin: hand over to there.
self=$(readlink -f "$0")
exec "${self%/*}/../../bin/${self##*/}" "$@"
"""


class InstallData(Distribution().get_command_class("install_data")):
    """Adds a file to lib/<package> for each console script; colcon replaces them by its own."""

    def run(self) -> None:
        """Install the data files, then these."""
        super().run()
        folder = os.path.join(self.install_dir, "lib", PACKAGE)
        self.mkpath(folder)
        for name in CONSOLE_SCRIPTS:
            path = os.path.join(folder, name)
            with open(path, "w", encoding="utf-8") as file:
                file.write(HAND_OVER)
            os.chmod(path, 0o755)  # noqa: S103 - everyone may run it
            self.outfiles.append(path)


setup(
    name=PACKAGE,
    version="0.1.0",
    description="Infers which local Nash equilibrium people play, and plans a robot's part of it.",
    author="gameinfer_ros maintainers",
    maintainer="gameinfer_ros maintainers",
    maintainer_email="maintainers@gameinfer-ros.dev",
    license="Apache-2.0",
    packages=find_packages(include=[f"{PACKAGE}*", "msg_adapters*"]),
    package_data={f"{PACKAGE}.experiments.report": ["*.j2"], f"{PACKAGE}.view": ["*.html"]},
    zip_safe=False,
    data_files=[
        ("share/ament_index/resource_index/packages", [f"resource/{PACKAGE}"]),
        (f"share/{PACKAGE}", ["package.xml"]),
        *SHARED_FILES,
    ],
    cmdclass={"install_data": InstallData},
    python_requires=">=3.10",
    # The lower bounds are what Ubuntu 24.04 ships, but for pydantic (1.10 there), joblib (1.3),
    # mcap and rosbags, which it has no packages of.
    install_requires=[
        "aiohttp>=3.9",
        "argcomplete>=3.1",
        "filelock>=3.13",
        "Jinja2>=3.1",
        "joblib>=1.4",
        "matplotlib>=3.6",
        "mcap>=1.1",
        "numba>=0.58",
        "numpy>=1.26",
        "Pillow>=10.2",
        "pydantic>=2.6",
        "rich>=13.0",
        "rosbags>=0.11",
        "ruamel.yaml>=0.17.21",
        "scipy>=1.11",
        "typing_extensions>=4.10",
    ],
    extras_require={
        "dask": ["distributed>=2024.1"],
        "test": [
            "distributed>=2024.1",
            "hypothesis>=6.90",
            "mcap-ros2-support>=0.5",
            "packaging>=23.2",
            "pytest>=7.4",
            "pytest-xdist>=3.4",
            "selenium>=4.18",
        ],
        "docs": ["furo>=2024.8", "latex2mathml>=3.77", "myst-parser>=4.0", "sphinx>=8.1"],
        "dev": ["mypy>=1.10", "ruff>=0.9"],
    },
    entry_points={
        "console_scripts": [f"{name} = {target}" for name, target in CONSOLE_SCRIPTS.items()]
    },
)
