"""ROS 2's services for log levels: what each answers of a node's logger."""

import asyncio

import pytest

from busflow.clock import SystemClock
from busflow.log import Log
from busflow.msgs.rcl_interfaces import GetLoggerLevels, LoggerLevel, SetLoggerLevels
from busflow.wire.queries.logger_services import LoggerServices


@pytest.fixture
def logged():
    """A log, the services of its node /left/arm, and the lines."""
    lines = []
    log = Log(SystemClock(), sinks=(lambda record: lines.append(record.event),))
    return log, LoggerServices(log, "/left/arm"), lines


def set_level(services, name, level):
    levels = [LoggerLevel(name=name, level=level)]
    (result,) = asyncio.run(services.set(SetLoggerLevels.Request(levels=levels))).results
    return result


def level(services, name):
    (found,) = asyncio.run(services.get(GetLoggerLevels.Request(names=[name]))).levels
    return found.level


@pytest.mark.parametrize("name", ["/left/arm", "left.arm"])
def test_level_is_set_for_existing_loggers(logged, name):
    log, services, lines = logged
    logger, other = log.bind("/left/arm").bind(joint="knee"), log.bind("/other")
    logger.debug("unseen")
    assert level(services, name) == 20
    assert set_level(services, name, 10).successful
    logger.debug("seen")
    other.debug("unseen")
    assert (level(services, name), lines) == (10, ["seen"])
    set_level(services, name, 40)
    logger.warning("unseen")
    log.bind("/left/arm").error("seen")
    assert lines == ["seen", "seen"]


def test_foreign_logger_and_odd_level_are_refused(logged, golden):
    log, services, _ = logged
    assert level(services, "rcl") == LoggerLevel.LOG_LEVEL_UNKNOWN
    golden(set_level(services, "rcl", 10).reason)
    refused = set_level(services, "left.arm", 15)
    assert (refused.successful, refused.reason.endswith("50 (critical), not 15")) == (False, True)
    assert log.level_of("/left/arm") == "info"
