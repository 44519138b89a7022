"""The package, for colcon."""

from setuptools import setup

NAME = "clearway_ros"

setup(
    name=NAME,
    version="0.1.0",
    description="Walks to where a picture was taken: a clearway agent between a camera and a base.",
    license="MIT",
    packages=[NAME],
    data_files=[
        ("share/ament_index/resource_index/packages", [f"resource/{NAME}"]),
        (f"share/{NAME}", ["package.xml"]),
        (f"share/{NAME}/launch", ["launch/clearway.launch.py"]),
        (f"share/{NAME}/config", ["config/clearway.yaml"]),
    ],
    install_requires=["setuptools"],  # clearway itself is installed by pip, see the README
    zip_safe=True,
    entry_points={"console_scripts": [f"clearway_node = {NAME}.node:main"]},
)
