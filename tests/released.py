"""Released versions as test data: launch files, plugins, examples; wheels of `busflow-ui` and `busflow-assistant`."""

from pathlib import Path
from zipfile import ZipFile

RELEASES = sorted((Path(__file__).parent / "cases/releases").iterdir())


def wheel(release: Path, distribution: str) -> ZipFile:
    """Open the wheel of a distribution, e.g. `busflow_ui`, as a version released it."""
    (path,) = release.glob(f"{distribution}-*.whl")
    return ZipFile(path)
