"""One report of several processes: what is published is counted once, and every line of the ledger still balances."""

from busflow.processes.report import merged
from busflow.processes.worker_process import ProcessOutcome
from busflow.runner.report import Report


class Member:
    """What the account reads of a process."""

    def __init__(self, name, nodes, *, report=None, lives=()):
        self.name, self.nodes, self.report, self.outcomes = name, nodes, report, list(lives)
        self.pid, self.restarts, self.state = 7, len(self.outcomes), type("State", (), {"value": "running"})


def line(node, published, delivered, dropped=0, queued=0):
    drops = {"overflow": dropped} if dropped else {}
    counts = {"published": published, "delivered": delivered, "dropped": dropped, "queued": queued, "drops": drops}
    return {"node": node, "depth": 10, "overflow": "drop_oldest", **counts}


def told(name, *, published=0, arrived=0, losses=None, lines=()):
    topic = {"name": "/t", "type": "a/msg/B", "published": published, "arrived": arrived, "losses": losses or {}}
    return {
        "nodes": [{"name": name, "plugin": "p", "state": "stopped", "parameters_set": 0}],
        "topics": [topic | {"subscriptions": list(lines)}],
        "services": [],
        "timers": [],
        "inbox": {"dropped": 1, "refused": 0},
        "blocks": [],
        "log_lines_lost": 0,
    }


MAIN = Report("run", 0, "system", 1.0, 0, nodes=(), topics=(), timers=())


def test_a_message_is_counted_where_it_is_published():
    source = Member("a", ("/source",), report=told("/source", published=100))
    sink = told("/sink", published=97, arrived=97, losses={"lost": 3}, lines=[line("/sink", 97, 90, 7)])
    report = merged(MAIN, [source, Member("b", ("/sink",), report=sink)], ["/sink", "/source"])
    (topic,) = report.topics
    assert (topic.published, topic.arrived, topic.losses) == (100, 0, {"lost": 3})
    assert [node.name for node in report.nodes] == ["/sink", "/source"]
    assert report.inbox_dropped == 2


def test_last_messages_of_killed_process_count():
    life = ProcessOutcome(6, told("/source", published=9), "it was ended")
    source = Member("a", ("/source",), report=told("/source", published=4), lives=[life])
    sink = told("/sink", published=17, arrived=17, lines=[line("/sink", 17, 17)])
    (topic,) = merged(MAIN, [source, Member("b", ("/sink",), report=sink)], ["/sink", "/source"]).topics
    assert topic.published == topic.subscriptions[0].delivered == 17


def test_backlog_of_a_dead_process_counts_as_dropped():
    life = ProcessOutcome(
        6, told("/sink", published=50, arrived=50, lines=[line("/sink", 50, 47, 1, 2)]), "it was ended"
    )
    now = told("/sink", published=20, arrived=20, lines=[line("/sink", 20, 19, 0, 1)])
    report = merged(MAIN, [Member("b", ("/sink",), report=now, lives=[life])], ["/sink"])
    (found,) = report.topics[0].subscriptions
    assert (found.published, found.delivered, found.dropped, found.queued) == (70, 66, 3, 1)
    assert found.drops == {"overflow": 1, "process ended": 2}
    assert [each.fates for each in report.processes] == [(), ("it was ended",)]


def test_process_without_report_has_failed_nodes():
    report = merged(MAIN, [Member("b", ("/sink",), lives=[ProcessOutcome(6, None, "it was ended")])], ["/sink"])
    assert [(node.name, node.state) for node in report.nodes] == [("/sink", "failed")]


def test_early_messages_are_no_drops_of_subscriptions():
    here = told("/source", published=100, losses={"early": 3}, lines=[line("/watcher", 100, 100)])
    sink = told("/sink", published=95, arrived=95, lines=[line("/sink", 95, 95)])
    report = merged(MAIN, [Member("a", ("/source",), report=here), Member("b", ("/sink",), report=sink)], ["/sink"])
    (topic,) = report.topics
    assert topic.losses == {"early": 3}
    assert {each.node: each.drops for each in topic.subscriptions} == {"/watcher": {}, "/sink": {"unmatched": 2}}


def test_messages_while_a_process_was_away_are_drops():
    life = ProcessOutcome(6, told("/sink", published=50, arrived=50, lines=[line("/sink", 50, 50)]), "it was ended")
    now = told("/sink", published=20, arrived=20, losses={"lost": 2}, lines=[line("/sink", 20, 19, 0, 1)])
    source = Member("a", ("/source",), report=told("/source", published=100, lines=[line("/watcher", 100, 100)]))
    report = merged(MAIN, [source, Member("b", ("/sink",), report=now, lives=[life])], ["/source", "/sink"])
    watcher, sink = report.topics[0].subscriptions
    assert (watcher.published, watcher.dropped) == (100, 0)
    assert (sink.published, sink.delivered, sink.dropped, sink.queued) == (98, 69, 28, 1)
    assert sink.drops == {"unmatched": 28}
    assert report.topics[0].losses == {"lost": 2}
