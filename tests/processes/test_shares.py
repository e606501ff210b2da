"""The part of a run that each process records, and the name of its file."""

from busflow.launchfile.load.load import load
from busflow.launchfile.model.description import RecordSpec
from busflow.launchfile.model.placement import placed
from busflow.processes.shares import Shares, unlike
from busflow.runner.graph import Graph
from tests.processes.conftest import NODES

TEXT = """
plugins: [NODES]
processes: {far: {}, arm: {}}
nodes:
  source: {plugin: source, process: far}
  one: {plugin: sink, process: arm}
  two: {plugin: sink, process: arm}
"""


def test_names_that_are_taken_become_longer():
    assert unlike("far", {"near"}) == "far"
    assert unlike("far", {"far", "far_"}) == "far__"


def test_each_process_records_its_own_share(project):
    (project / "run.yaml").write_text(TEXT.replace("NODES", str(NODES)))
    description = load(project / "run.yaml")
    shares = Shares(RecordSpec("run.mcap"), placed(description), Graph([description]).plan())
    assert shares.processes == ("main", "far", "arm")
    assert shares.stems == {"main": "main", "far": "far", "arm": "arm"}
    share = shares.of("far", project / "far.mcap")
    assert share.nodes == {"/source", "/one", "/two"}
    assert share.outside == {"/numbers": "arm"}
