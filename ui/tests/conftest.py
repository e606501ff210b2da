"""The fixtures of busflow's own tests: a place where runs are found, and labs that run there."""

pytest_plugins = ("tests.conftest", "tests.cli.conftest", "tests.whole_files")
