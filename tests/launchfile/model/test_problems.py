"""Problems: collected, bounded, in the order of the files."""

import pytest

from busflow.errors import LaunchError, Place, Problem
from busflow.launchfile.model.problems import MOST, Problems


def test_problems_come_by_file_then_line_and_those_without_a_place_first():
    problems = Problems()
    assert not problems
    for file, line in (("b", 1), ("a", 9), ("a", 2)):
        problems.add(Problem("x", f"{file}{line}", None, Place(file, line, 1)))
    problems.add(Problem("x", "nowhere"))
    assert [each.message for each in problems.sorted(["a", "b"])] == ["nowhere", "a2", "a9", "b1"]
    assert problems


def test_one_too_many_ends_the_search_and_is_told():
    problems = Problems()
    problems.add(*(Problem("x", str(n)) for n in range(MOST)))
    with problems.collecting():
        problems.add(Problem("x", "one more"))
        pytest.fail("adding it raises")
    found = problems.sorted([])
    assert len(found) == MOST + 1
    assert found[-1].message == f"there are more than {MOST} problems"


def test_what_is_raised_inside_is_kept():
    problems = Problems()
    with problems.collecting():
        raise LaunchError([Problem("x", "inside")])
    assert [each.message for each in problems.sorted([])] == ["inside"]
