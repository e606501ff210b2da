"""Applies profiles: named changes of a launch file, merged over it before any expression is evaluated."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace

from busflow.launchfile.load.expression import Scope
from busflow.launchfile.load.resolver import Resolver
from busflow.launchfile.model.problems import Problems, problem_at
from busflow.launchfile.yaml.value import Origin, StatedBy, Value, on_command_line
from busflow.text import did_you_mean


def from_command_line(names: Iterable[str]) -> list[Value]:
    """Return the profiles that `--profile` names."""
    option = "--profile "
    places = ((name, on_command_line(option + name, len(option), len(name))) for name in names)
    return [Value(name, Origin(StatedBy.COMMAND_LINE, place)) for name, place in places]


def chosen(root: Value, asked: Sequence[Value], scope: Scope, problems: Problems) -> Value:
    """Return a file with the requested profiles applied in order; with its own `profile` if none is requested."""
    stated = root.members.get("profile")
    if not asked and stated is not None and stated.content is not None:
        resolver = Resolver(scope, problems)
        asked = [resolver.resolve(stated)]
        asked = [] if resolver.failed else asked
    known = root.section("profiles")
    under = root
    for each in asked:
        profile = known.get(str(each.content))
        if profile is None:
            fix = did_you_mean(str(each.content), known) if known else "add it below `profiles:`"
            problems.add(problem_at("unknown-profile", f"there is no profile {each.content!r}", fix, each.origin))
        elif isinstance(profile.content, dict):  # otherwise it is reported with the other keys
            under = replace(under.merged(profile), origin=root.origin)
    return under
