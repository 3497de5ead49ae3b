"""The study of the wheel in clean environments: what it is installed with."""

from __future__ import annotations

import zipfile
from pathlib import Path

from studies import wheels
from studies.commands import Outcome

METADATA = """Metadata-Version: 2.1
Name: stripfold
Version: 0.1.0
Requires-Dist: numpy>=2.0
Requires-Dist: netCDF4>=1.7
Requires-Dist: colorama; sys_platform == "win32"
Provides-Extra: vision
Requires-Dist: av>=14; extra == "vision"
Requires-Dist: stripfold[plot]; extra == "vision"
Provides-Extra: dev
Requires-Dist: pytest>=8; extra == "dev"
"""


def test_all_dependencies_of_a_wheel_are_direct_ones(tmp_path: Path) -> None:
    wheel = tmp_path / "stripfold-0.1.0-py3-none-any.whl"
    with zipfile.ZipFile(wheel, "w") as file:
        file.writestr("stripfold-0.1.0.dist-info/METADATA", METADATA)
    assert [str(need) for need in wheels.dependencies(wheel)] == ["numpy>=2.0", "netCDF4>=1.7", "av>=14"]


def test_versions_are_those_of_the_environment(tmp_path: Path) -> None:
    place = tmp_path / "lib" / "python3.11" / "site-packages" / "scikit_fem-10.0.0.dist-info"
    place.mkdir(parents=True)
    (place / "METADATA").write_text("Metadata-Version: 2.1\nName: scikit_fem\nVersion: 10.0.0\n")
    assert wheels.installed(tmp_path, ["scikit-fem"]) == "scikit-fem 10.0.0"


def test_why_a_command_did_not_run() -> None:
    assert wheels.reason(Outcome("said", 0, {})) == ""
    assert wheels.reason(Outcome("said\n", 2, {})) == "said"
    assert wheels.reason(Outcome("", -9, {})) == "exit code -9"
